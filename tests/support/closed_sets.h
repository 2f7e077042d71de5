// The implicit rule (CODING.md, section 9) from the other side: what each split was coded against, found out by
// decoding everything in order, and from that what a mesh of some of the segments has to be.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tests/support/asset_helpers.h"

namespace fanstream::testing {

class ClosedSets {
 public:
  // A failure is the test's.
  explicit ClosedSets(const OpenAsset& asset);

  // By cell, the finest generation in the largest mesh that has no more than the first prefixes[cell] segments of each
  // cell: as far as for every split the latest change of each vertex in its ring is in that mesh too. 0 for cells whose
  // parent is not complete.
  std::vector<std::uint32_t> largest(std::span<const std::uint32_t> prefixes) const;
  // How many vertices that mesh has.
  std::uint32_t vertex_count(std::span<const std::uint32_t> generations) const;

 private:
  struct Step {
    std::uint32_t cell = 0;
    std::uint32_t generation = 0;  // 0: a vertex of FM0 as it is there
    bool operator==(const Step&) const = default;
  };
  struct Cell {
    std::uint32_t begin = 0;               // the last generation before its slab
    std::uint32_t end = 0;                 // the last of it
    std::vector<std::vector<Step>> needs;  // by generation of the slab, of other cells
    std::vector<std::uint32_t> splits;     // by generation of the slab
  };
  struct Recorder;

  const OpenAsset& asset_;
  std::vector<Cell> cells_;
};

}  // namespace fanstream::testing
