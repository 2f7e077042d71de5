// How much of an asset a piece of its surface takes (DESIGN.md, section 2): to see one disc in full, which splits and
// which bytes must be there?
//
// A split of root r in generation g was coded against r's ring as it was then. It can be decoded once r and every
// vertex w of that ring have undergone what made them what they were: the split that last moved or made w, wherever
// that was coded. Cells are taken by prefix, so the unit is (cell, generation): it needs the cell's own earlier
// generations, its parent cell complete, and for every split in it the (cell, generation) of each ring vertex's latest
// change. A change of r's ring is always a change of a vertex that is in the ring afterwards, so nothing else is
// needed.
// That closure is also what a client waits for (ProgressiveMesh).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tests/bench/open_asset.h"

namespace fanstream::bench {

// What depends on what in one asset, found by decoding it once.
class SplitDependencies {
 public:
  static Result<SplitDependencies> of(std::shared_ptr<const OpenAsset> asset);

  // For each cell the last generation that must be there, 0 for none, so that each of `vertices` (numbers of the full
  // model) is in place and all faces around it are faces of the full model.
  std::vector<std::uint32_t> needed(std::span<const VertexId> vertices) const;

  // Of all splits; `needed` as above.
  double split_share(std::span<const std::uint32_t> needed) const;
  // Of all segment bytes, whole segments; FM0 and tables, which everybody gets, are in neither figure.
  double byte_share(std::span<const std::uint32_t> needed) const;

  const FanState& full() const { return full_; }
  const OpenAsset& asset() const { return *asset_; }

 private:
  struct Step {
    std::uint32_t cell = 0;
    std::uint32_t generation = 0;  // 0: the base, always there
  };
  struct Cell {
    std::uint32_t start = 0;                      // the last generation of the slab before
    std::vector<std::vector<Step>> dependencies;  // by generation after start
    std::vector<std::uint32_t> splits;            // by generation after start
  };
  struct Recorder;

  std::shared_ptr<const OpenAsset> asset_;
  FanState full_;
  std::vector<Cell> cells_;
  std::vector<Step> latest_;  // by vertex: its latest change
};

struct ForcedShare {
  double disc = 0.0;  // the share of the vertices that are in the disc
  double splits = 0.0;
  double bytes = 0.0;
};

// The mean over `seeds` discs: around a random point of the surface (uniform by area), the vertices nearest to it in
// space, `disc` of them all, at least one. The same seed gives the same discs on every machine.
ForcedShare forced_share(const SplitDependencies& dependencies, double disc, std::uint32_t seeds = 16,
                         std::uint64_t first_seed = 1);

}  // namespace fanstream::bench
