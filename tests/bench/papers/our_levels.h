// The levels of a mesh as our generations make them, to be drawn as a client draws them.
#pragma once

#include <memory>

#include "common/fans/fan_cover.h"
#include "server/build/asset_builder.h"
#include "tests/bench/level_quality.h"

namespace fanstream::bench {

// A mesh simplified as the builder does it, with all its defaults unless `base_vertices` says where to stop, and its
// levels at any number of vertices, coarse to fine.
class OurLevels {
 public:
  // Fails as build_asset does, and (limit) where merging ends before it comes to `base_vertices`.
  static Result<std::unique_ptr<OurLevels>> build(const TriangleMesh& mesh,
                                                  std::optional<std::uint32_t> base_vertices = {});
  OurLevels(const OurLevels&) = delete;
  OurLevels& operator=(const OurLevels&) = delete;

  std::uint32_t base_vertices() const { return history_.base_vertices; }
  // Precondition: not fewer than in the call before or base_vertices(), not more than the mesh has.
  TriangleMesh level(std::uint32_t vertices);

 private:
  OurLevels(const TriangleMesh& mesh, MergeHistory history);

  PositionGrid grid_;
  MergeHistory history_;
  CodedHistory coded_;
  LevelReplay replay_;
};

}  // namespace fanstream::bench
