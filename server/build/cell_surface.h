// How far each cell may be off, layer by layer, and where its part of the surface looks: what its patches say, taken
// together.
#pragma once

#include <cstdint>
#include <vector>

#include "common/asset/asset_layout.h"
#include "server/build/surface_error.h"

namespace fanstream {

// Filled while the history is replayed, coarse to fine; what its patches say is not needed before finish().
class CellSurface {
 public:
  void add(std::uint32_t cell, std::uint32_t merge);  // a split of the cell in the layer at hand
  void end_layer(std::uint32_t cell);
  // Then. Nothing finer may be further off than what it refines, nor look where that does not.
  void finish(const SurfaceErrors& surface, const std::vector<CellEntry>& cells);

  // After finish().
  float error(std::uint32_t cell, std::uint32_t segment) const { return cells_[cell].errors[segment]; }
  CodedCone cone(std::uint32_t cell) const { return cells_[cell].cone; }

 private:
  struct Cell {
    std::vector<std::uint32_t> merges;
    std::vector<std::uint32_t> layer_ends;  // into merges
    std::vector<float> errors;              // by layer
    std::vector<std::uint32_t> patches;     // with those of its children
    CodedCone cone;
  };
  Cell& at(std::uint32_t cell);
  static void read(const SurfaceErrors& surface, Cell& cell);
  CodedCone cone_of(const SurfaceErrors& surface, const std::vector<std::uint32_t>& patches);

  std::vector<Cell> cells_;
  std::vector<NormalCone> cones_;  // scratch
};

}  // namespace fanstream
