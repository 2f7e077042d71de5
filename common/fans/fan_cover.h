// Partitions a triangle mesh into triangle fans, every face in exactly one of them.
#pragma once

#include <cstddef>
#include <span>

#include "common/fans/fan_mesh.h"
#include "common/mesh/triangle_mesh.h"
#include "common/support/result.h"

namespace fanstream {

enum class CoverMethod {
  // Suzuki, Okamoto, Kanai, section 3.2, candidates taken by ascending vertex id. No two of its closed fans are
  // neighbours, which the paper needs for merging; it issues 3.0 to 3.5 vertices per vertex of the mesh.
  paper,
  // Largest remaining star first: about 2.9 vertices per vertex.
  greedy,
  // Greedy, then local searches for fewer fans: 2.65 to 2.82; up to 4,096 vertices, where more is sought, 2.78 at
  // most, and on meshes of a few hundred mostly the fewest there are. A regular mesh admits no better than 2.67 (less
  // only where boundaries leave fewer than two faces per vertex).
  best,
};

// The fans by ascending centre (one centre may have several), the paper's isolated triangles last, rings
// counter-clockwise; `vertices` stays empty, for the caller to fill. Accepts what VertexStars::build accepts and fails
// as it does. Depends on the mesh alone: the same on every machine. Time is linear in the faces, about 0.3 us each, and
// up to 25 ms more where more is sought; working memory about 50 bytes a face.
Result<FanMesh> cover_with_fans(std::size_t vertex_count, std::span<const Triangle> triangles,
                                CoverMethod method = CoverMethod::best);

// What the paper's tables count.
struct FanStatistics {
  std::size_t vertices = 0;
  std::size_t faces = 0;
  std::size_t fans = 0;
  std::size_t closed_fans = 0;
  std::size_t isolated_triangles = 0;  // fans of one face
  std::size_t issued_vertices = 0;     // handed to the pipeline when drawn: faces + 2 * fans
  double issued_per_vertex() const;    // 0 for a mesh without vertices
};
FanStatistics fan_statistics(std::size_t vertex_count, const FanMesh& mesh);

// Whether the fans are exactly the triangles: each in one fan, once, the same way round; rings inside the ring list
// and of a legal length; a closed flag where and only where a fan goes all the way around. Fails (bad_input) naming the
// first fan or triangle at fault. Trusts nothing in `mesh`.
Result<void> check_cover(std::span<const Triangle> triangles, const FanMesh& mesh);

}  // namespace fanstream
