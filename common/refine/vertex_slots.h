// Vertex numbers that are handed out as they are needed, so that what is in the mesh lies close together in memory,
// whatever part of the model it is.
#pragma once

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

// Numbers from `first` on, kept by groups of 64. Not thread safe.
class VertexSlots {
 public:
  static constexpr std::uint32_t kGroup = 64;

  VertexSlots() = default;  // of no use: numbers are given by the asset
  explicit VertexSlots(VertexId first) : first_(first), in_use_(true) {}

  bool in_use() const { return in_use_; }
  VertexId end() const { return first_ + static_cast<VertexId>(used_.size()) * kGroup; }  // beyond all ever taken

  // The lowest free number.
  VertexId take() {
    while (first_free_ < used_.size() && used_[first_free_] == ~std::uint64_t{0}) ++first_free_;
    if (first_free_ == used_.size()) used_.push_back(0);
    const auto bit = static_cast<std::uint32_t>(std::countr_one(used_[first_free_]));
    used_[first_free_] |= std::uint64_t{1} << bit;
    return first_ + static_cast<VertexId>(first_free_) * kGroup + bit;
  }
  void give_back(VertexId v) {
    const std::size_t group = group_of(v);
    assert((used_[group] >> bit_of(v) & 1U) != 0);
    used_[group] &= ~(std::uint64_t{1} << bit_of(v));
    if (group < first_free_) first_free_ = group;
    if (used_[group] == 0) emptied_.push_back(static_cast<std::uint32_t>(group));
  }
  // Whether no other number of the same group is taken.
  bool is_alone(VertexId v) const { return used_[group_of(v)] == std::uint64_t{1} << bit_of(v); }

  struct Range {
    VertexId first = 0;
    VertexId last = 0;  // one past it
    friend bool operator==(const Range&, const Range&) = default;
  };
  Range group(VertexId v) const { return range(group_of(v), group_of(v) + 1); }
  // The groups that have become free since the last call and still are, as ascending ranges that take in as many of the
  // free groups on both sides as a page of memory may reach.
  std::vector<Range> take_emptied();

  std::size_t memory_bytes() const {
    return used_.capacity() * sizeof(used_[0]) + emptied_.capacity() * sizeof(emptied_[0]);
  }

 private:
  std::size_t group_of(VertexId v) const { return (v - first_) / kGroup; }
  std::uint32_t bit_of(VertexId v) const { return (v - first_) % kGroup; }
  Range range(std::size_t begin, std::size_t end) const {
    return {first_ + static_cast<VertexId>(begin) * kGroup, first_ + static_cast<VertexId>(end) * kGroup};
  }

  std::vector<std::uint64_t> used_;  // by group, a bit for each number
  std::size_t first_free_ = 0;       // no group before it has a free number
  std::vector<std::uint32_t> emptied_;
  VertexId first_ = 0;
  bool in_use_ = false;
};

}  // namespace fanstream
