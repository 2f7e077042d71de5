// How far each cell may be off, layer by layer, and where its part of the surface looks: what its patches say, taken
// together.
#pragma once

#include <cstdint>
#include <vector>

#include "common/asset/asset_layout.h"
#include "server/build/surface_error.h"

namespace fanstream {

// Filled while the history is replayed, coarse to fine.
class CellSurface {
 public:
  // Keeps a reference.
  explicit CellSurface(const SurfaceErrors& surface) : surface_(surface) {}

  void add(std::uint32_t cell, std::uint32_t merge);  // a split of the cell in the layer at hand
  void end_layer(std::uint32_t cell);
  // Then: nothing finer may be further off than what it refines, nor look where that does not.
  void finish(const std::vector<CellEntry>& cells);

  float error(std::uint32_t cell, std::uint32_t segment) const { return cells_[cell].errors[segment]; }
  CodedCone cone(std::uint32_t cell) const;

 private:
  struct Cell {
    std::vector<float> errors;           // of layers that ended
    float current = 0.0F;                // of the one at hand
    std::vector<std::uint32_t> patches;  // numbers in surface_.patches; with those of its children once it is finished
  };
  Cell& at(std::uint32_t cell);

  const SurfaceErrors& surface_;
  std::vector<Cell> cells_;
};

}  // namespace fanstream
