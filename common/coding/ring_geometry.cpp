#include "common/coding/ring_geometry.h"

#include <numeric>

#include "common/coding/ring_kernels.h"

namespace fanstream {

void RingGeometry::load(const LinkedFans& fans, VertexId root) {
  own_walk_.go_around(fans, root);
  load(fans, root, own_walk_);
}

void RingGeometry::load_long(const LinkedFans& fans) {
  long_ids_.resize(6 * stride());
  long_numbers_.resize(5 * stride() + 16);
  LinkedFans::CornerId corner = fans.corner(root_);
  for (std::size_t i = 0; i < 2 * stride(); ++i) {
    const LinkedFans::Corner c = fans.corners()[corner];
    if (i < stride()) long_ids_[i] = c.neighbour;
    long_ids_[stride() + i] = corner;
    long_ids_[3 * stride() + i] = LinkedFans::back_of(corner);
    corner = c.next;
  }
}

void RingGeometry::measure(std::span<const FanVertex> vertices, Float4 unit) {
  RingKernels::best().measure(*this, {vertices.data(), unit});
}

std::uint32_t RingGeometry::rank_of_first(std::uint32_t length, std::uint32_t first) const {
  std::vector<float> reach(stride());
  RingKernels::best().find_reaches(*this, length, reach.data());
  std::uint32_t rank = 0;
  for (std::uint32_t i = 0; i < size_; ++i) {
    rank += static_cast<std::uint32_t>(reach[i] > reach[first] || (reach[i] == reach[first] && i < first));
  }
  return rank;
}

std::uint32_t RingGeometry::first_of_rank(std::uint32_t length, std::uint32_t rank) const {
  return RingKernels::best().first_of_rank(*this, length, rank);
}

}  // namespace fanstream
