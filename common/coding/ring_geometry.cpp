#include "common/coding/ring_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace fanstream {
namespace {

constexpr float kLeast = -std::numeric_limits<float>::infinity();

Uint4 lanes_from(std::uint32_t first) { return kLaneNumbers + uint4(first); }
Float4 larger(Float4 a, Float4 b) { return a > b ? a : b; }

// Sums of the lanes up to each.
Float4 prefix_sums(Float4 v) {
  const Float4 zero{};
  v += __builtin_shufflevector(zero, v, 0, 4, 5, 6);
  return v + __builtin_shufflevector(zero, v, 0, 1, 4, 5);
}

}  // namespace

void RingGeometry::grow(std::size_t size) {
  capacity_ = std::max<std::size_t>(32, 2 * size);
  corners_.resize(2 * capacity_ + 16);
  ids_.resize(2 * capacity_ + 16);
  neighbours_.resize(capacity_ + 16);
  spokes_.resize(2 * capacity_ + 16);
  spoke_sums_.resize(2 * capacity_ + 16);
  square_sums_.resize(2 * capacity_ + 16);
  reaches_.resize(capacity_ + 16);
}

// Four neighbours for place(), and where kOutside is among them, as position + 1.
void RingGeometry::note(std::uint32_t at, Uint4 ids, Uint4& gap) {
  const Uint4 lane = lanes_from(at);
  const Uint4 inside = less(lane, uint4(size_));
  const Uint4 outside = mask_of(ids == uint4(kOutside));
  store4(neighbours_.data() + at, chosen(inside & ~outside, ids, uint4(root_)));
  gap |= inside & outside & (lane + uint4(1));
}

void RingGeometry::set_gap(Uint4 noted) {
  const std::uint32_t found = any_bits(noted);
  gap_ = found != 0 ? found - 1 : size_;
}

template <std::uint32_t blocks>
void RingGeometry::lay_out(const FanWalk& walk) {
  std::array<Uint4, blocks> ids;
  std::array<Uint4, blocks> corners;
  Uint4 gap{};
  for (std::uint32_t k = 0; k < blocks; ++k) {
    ids[k] = load4(walk.ids.data() + std::size_t{4} * k);
    corners[k] = load4(walk.corners.data() + std::size_t{4} * k);
    note(4 * k, ids[k], gap);
  }
  for (const std::uint32_t from : {0U, size_}) {
    for (std::uint32_t k = 0; k < blocks; ++k) {
      store4(ids_.data() + from + 4 * k, ids[k]);
      store4(corners_.data() + from + 4 * k, corners[k]);
    }
  }
  set_gap(gap);
}

void RingGeometry::lay_out_long(const LinkedFans& fans) {
  LinkedFans::CornerId corner = fans.corner(root_);
  for (std::uint32_t i = 0; i < 2 * size_; ++i) {
    const LinkedFans::Corner c = fans.corners()[corner];
    ids_[i] = c.neighbour;
    corners_[i] = corner;
    corner = c.next;
  }
  Uint4 gap{};
  for (std::uint32_t at = 0; at < size_; at += 4) note(at, load4(ids_.data() + at), gap);
  set_gap(gap);
}

void RingGeometry::load(const LinkedFans& fans, VertexId root) {
  FanWalk walk;
  walk.go_around(fans, root);
  load(fans, root, walk);
}

void RingGeometry::load(const LinkedFans& fans, VertexId root, const FanWalk& walk) {
  size_ = walk.size;
  root_ = root;
  if (size_ > capacity_) grow(size_);
  if (size_ <= 8) {
    lay_out<2>(walk);
  } else if (size_ <= 16) {
    lay_out<4>(walk);
  } else {
    lay_out_long(fans);
  }
}

// Sums run in the order that CODING.md states: it is part of the format, since floating-point sums depend on it.
template <std::uint32_t blocks>
void RingGeometry::place_blocks(std::span<const FanVertex> vertices, Float4 unit) {
  const VertexId* neighbours = neighbours_.data();
  Float4* spokes = spokes_.data();
  float* sums = square_sums_.data();
  const Int4 centre = vertices[root_].place4();
  Float4* spoke_sums = spoke_sums_.data();
  Float4 sum{};
  spoke_sums[0] = sum;
  Float4 before{};  // the spoke before; nothing before the first
  std::array<Float4, 4> normals{};
  Float4 square_sum{};
  sums[0] = 0.0F;
  for (std::uint32_t k = 0; k < block_count<blocks>(); ++k) {
    std::array<Float4, 4> s;
    for (std::uint32_t j = 0; j < 4; ++j) {
      s[j] = to_float4(vertices[neighbours[4 * k + j]].place4() - centre) * unit;
      spokes[4 * k + j] = s[j];
      sum += s[j];
      spoke_sums[4 * k + j + 1] = sum;
      normals[j] += cross_rotated(before, s[j]);  // zero beside the gap
      before = s[j];
    }
    const Float4 running = prefix_sums(sums3(s[0] * s[0], s[1] * s[1], s[2] * s[2], s[3] * s[3])) + square_sum;
    store4(sums + 4 * k + 1, running);
    square_sum = __builtin_shufflevector(running, running, 3, 3, 3, 3);
  }
  const Float4 last = cross_rotated(spokes[size_ - 1], spokes[0]);
  normal_ = rotate_axes(((normals[0] + normals[1]) + (normals[2] + normals[3])) + last);
  mean_square_ = square_sum[0] / static_cast<float>(is_open() ? size_ - 1 : size_);
}

void RingGeometry::place(std::span<const FanVertex> vertices, Float4 unit) {
  if (size_ <= 8) {
    place_blocks<2>(vertices, unit);
  } else if (size_ <= 16) {
    place_blocks<4>(vertices, unit);
  } else {
    place_blocks<0>(vertices, unit);
  }
}

template <std::uint32_t blocks>
void RingGeometry::measure_blocks() {
  Float4* spokes = spokes_.data();
  Float4* spoke_sums = spoke_sums_.data();
  float* sums = square_sums_.data();
  Float4 bends{};
  for (std::uint32_t k = 0; k < block_count<blocks>(); ++k) {
    const Float4* s = spokes + 4 * k;
    const Float4 heights = sums3(s[0] * normal_, s[1] * normal_, s[2] * normal_, s[3] * normal_);
    bends += heights * heights;
  }
  const Float4 sum = spoke_sums[size_];
  for (std::uint32_t i = 0; i < 4 * block_count<blocks>(); ++i) {
    spokes[size_ + i] = spokes[i];
    spoke_sums[size_ + i + 1] = sum + spoke_sums[i + 1];
  }
  const Float4 square_sum = float4(sums[size_]);
  for (std::uint32_t k = block_count<blocks>(); k-- > 0;) {
    store4(sums + size_ + 4 * k + 1, load4(sums + 4 * k + 1) + square_sum);
  }
  bend_square_ = ((bends[0] + bends[1]) + (bends[2] + bends[3])) / static_cast<float>(is_open() ? size_ - 1 : size_);
}

void RingGeometry::measure() {
  const float length = std::sqrt(dot3(normal_, normal_));
  normal_ = length > 0.0F ? normal_ * float4(1.0F / length) : Float4{0.0F, 0.0F, 1.0F, 0.0F};
  if (size_ <= 8) {
    measure_blocks<2>();
  } else if (size_ <= 16) {
    measure_blocks<4>();
  } else {
    measure_blocks<0>();
  }
}

// Long spokes inside the arc speak for it, long wings against it: wings are neighbours of both centres.
Float4 RingGeometry::reach_block(std::uint32_t length, std::uint32_t at) const {
  const float* sums = square_sums_.data() + at;
  const Float4 inside = load4(sums + length) - load4(sums + 1);
  const Float4 with_wings = load4(sums + length + 1) - load4(sums);
  const Float4 reach = float4(1.4F) * inside - float4(0.4F) * with_wings;
  return chosen(less(lanes_from(at), uint4(size_)), reach, float4(kLeast));
}

void RingGeometry::reaches(std::uint32_t length) const {
  for (std::uint32_t at = 0; at < size_; at += 4) store4(reaches_.data() + at, reach_block(length, at));
}

std::uint32_t RingGeometry::rank_of_first(std::uint32_t length, std::uint32_t first) const {
  reaches(length);
  const float* reach = reaches_.data();
  std::uint32_t rank = 0;
  for (std::uint32_t i = 0; i < size_; ++i) {
    rank += static_cast<std::uint32_t>(reach[i] > reach[first] || (reach[i] == reach[first] && i < first));
  }
  return rank;
}

// Takes the farthest away, rank times.
template <std::uint32_t blocks>
std::uint32_t RingGeometry::nth_reach(std::uint32_t length, std::uint32_t rank) const {
  std::array<Float4, blocks> reach;
  for (std::uint32_t k = 0; k < blocks; ++k) reach[k] = reach_block(length, 4 * k);
  for (;; --rank) {
    Float4 most = reach[0];
    for (std::uint32_t k = 1; k < blocks; ++k) most = larger(most, reach[k]);
    most = larger(most, __builtin_shufflevector(most, most, 2, 3, 0, 1));
    most = larger(most, __builtin_shufflevector(most, most, 1, 0, 3, 2));
    Uint4 found{};
    for (std::uint32_t k = 0; k < blocks; ++k) found |= mask_of(reach[k] == most) & (Uint4{1, 2, 4, 8} << uint4(4 * k));
    const auto best = static_cast<std::uint32_t>(std::countr_zero(any_bits(found)));
    if (rank == 0) return best;
    for (std::uint32_t k = 0; k < blocks; ++k) {
      reach[k] = chosen(mask_of(lanes_from(4 * k) == uint4(best)), float4(kLeast), reach[k]);
    }
  }
}

std::uint32_t RingGeometry::first_of_rank(std::uint32_t length, std::uint32_t rank) const {
  if (size_ <= 8) return nth_reach<2>(length, rank);
  if (size_ <= 16) return nth_reach<4>(length, rank);
  reaches(length);
  std::vector<std::uint32_t> order(size_);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [this](std::uint32_t a, std::uint32_t b) { return reaches_[a] > reaches_[b]; });
  return order[rank];
}

}  // namespace fanstream
