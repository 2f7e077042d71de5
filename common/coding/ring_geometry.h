// What coder and decoder both see of a root before it is split: its canonical ring in space.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/coding/float4.h"
#include "common/fans/fan_split.h"

namespace fanstream {

// All lengths are in grid steps of the finest axis, in single precision with plain IEEE operations only, so that
// every machine computes the same bits. Reused from split to split to avoid allocation; not thread safe.
class RingGeometry {
 public:
  // `ring` as RingMesh::ring gives it; `unit` is the size of one code step of each axis. Position 0 is the canonical start.
  void assign(std::span<const VertexId> ring, VertexId root, std::span<const GridPoint> places, const glm::vec3& unit);

  std::uint32_t size() const { return size_; }
  std::uint32_t start() const { return start_; }  // where the canonical ring starts in the ring that was given
  bool is_open() const { return gap_ < size_; }
  std::uint32_t gap() const { return gap_; }  // position of kOutside, or size()
  VertexId id(std::uint32_t i) const { return ids_[i]; }
  Float4 spoke(std::uint32_t i) const { return spokes_[i]; }  // from the root; zero at the gap
  Float4 normal() const { return normal_; }                   // unit length
  float mean_length() const { return mean_length_; }                       // of the spokes
  float bend() const { return bend_; }                                     // mean distance of the ring from the root's tangent plane
  std::uint32_t wrap(std::uint32_t i) const { return i < size_ ? i : i - size_; }

  // For an arc of `length` ring steps, its possible first positions are ranked by how far the arc reaches out, since a
  // root that kept its place lies off the middle of its ring, away from the vertex it absorbed. Precondition: closed.
  std::uint32_t first_of_rank(std::uint32_t length, std::uint32_t rank) const;
  std::uint32_t rank_of_first(std::uint32_t length, std::uint32_t first) const;

 private:
  void measure();
  const float* reaches(std::uint32_t length) const;  // of the arcs of that length, by first position

  std::uint32_t size_ = 0;
  std::uint32_t start_ = 0;
  std::uint32_t gap_ = 0;
  float mean_length_ = 0.0F;
  float bend_ = 0.0F;
  Float4 normal_{};
  // At least size() entries each; spokes_ repeats the first at the end.
  std::vector<VertexId> ids_;
  std::vector<Float4> spokes_;
  std::vector<float> squares_;  // of the spokes' lengths
  mutable std::vector<float> reach_sums_;  // squared lengths of the first i spokes, twice around
  mutable std::vector<float> reaches_;
};

}  // namespace fanstream
