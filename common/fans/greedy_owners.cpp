#include <algorithm>
#include <bit>

#include "common/fans/cover_search.h"

namespace fanstream {
namespace {

// Stars of up to 7 free faces are told apart by number, larger ones by power of two: taking all in order of size would
// visit the whole mesh once for each size, in cold memory, and the cover comes out no smaller for it.
constexpr std::uint32_t kExactBuckets = 7;

std::uint32_t bucket_of(std::uint32_t free_faces) {
  if (free_faces <= kExactBuckets) return free_faces;
  return kExactBuckets + static_cast<std::uint32_t>(std::bit_width(free_faces / (kExactBuckets + 1)));
}

// Vertices by their number of free faces. Entries go stale when a count falls; they are dropped when they surface.
class FreeFaceQueue {
 public:
  explicit FreeFaceQueue(const VertexStars& stars) : free_(stars.vertex_count()) {
    std::uint32_t largest = 0;
    for (VertexId vertex = 0; vertex < stars.vertex_count(); ++vertex) {
      free_[vertex] = static_cast<std::uint32_t>(stars.star(vertex).size());
      largest = std::max(largest, free_[vertex]);
    }
    buckets_.resize(bucket_of(largest) + 1);
    for (VertexId vertex = static_cast<VertexId>(free_.size()); vertex-- > 0;) prefer(vertex);
  }

  void face_taken(VertexId vertex) { --free_[vertex]; }
  // Puts the vertex in front of its equals.
  void prefer(VertexId vertex) { buckets_[bucket(vertex)].push_back(vertex); }

  // The vertex in the highest bucket, or kNone when no face is free.
  VertexId pop() {
    while (buckets_.size() > 1) {
      std::vector<VertexId>& top = buckets_.back();
      if (top.empty()) {
        buckets_.pop_back();
        continue;
      }
      const VertexId vertex = top.back();
      top.pop_back();
      if (bucket(vertex) + 1 == buckets_.size()) return vertex;
      if (free_[vertex] > 0) prefer(vertex);
    }
    return kNone;
  }

 private:
  std::uint32_t bucket(VertexId vertex) const { return bucket_of(free_[vertex]); }

  std::vector<std::uint32_t> free_;
  std::vector<std::vector<VertexId>> buckets_;
};

}  // namespace

FaceOwners greedy_owners(const VertexStars& stars) {
  FaceOwners owners(stars.face_count(), kNone);
  FreeFaceQueue queue(stars);
  for (VertexId center = queue.pop(); center != kNone; center = queue.pop()) {
    for (const CornerId corner : stars.star(center)) {
      const FaceId face = face_of(corner);
      if (owners[face] != kNone) continue;
      owners[face] = center;
      for (const VertexId vertex : stars.triangles()[face]) queue.face_taken(vertex);
    }
    // Closed fans pack best side by side: the next centre should lie across an edge of this one's ring.
    for (const CornerId corner : stars.star(center)) {
      const FaceId outside = stars.face_across(corner);
      if (outside == kNone || owners[outside] != kNone) continue;
      const Triangle& triangle = stars.triangles()[outside];
      const VertexId a = stars.vertex(next_corner(corner));
      const VertexId b = stars.vertex(previous_corner(corner));
      for (const VertexId vertex : triangle) {
        if (vertex != a && vertex != b) queue.prefer(vertex);
      }
    }
  }
  return owners;
}

}  // namespace fanstream
