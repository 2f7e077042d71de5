// The faces around each vertex, in no order, as merges change them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace fanstream {

// About 20 bytes a triangle, and what is added. Not thread safe.
class FacesAround {
 public:
  // By rising numbers at first.
  FacesAround(std::size_t vertices, const std::vector<Triangle>& faces) : ranges_(vertices) {
    for (const Triangle& face : faces) {
      for (const VertexId v : face) ++ranges_[v].size;
    }
    std::uint32_t begin = 0;
    for (Range& range : ranges_) {
      range.begin = begin;
      begin += range.size;
      range.size = 0;
    }
    pool_.resize(begin);
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
      for (const VertexId v : faces[f]) pool_[ranges_[v].begin + ranges_[v].size++] = f;
    }
  }

  std::span<const std::uint32_t> of(VertexId v) const { return {pool_.data() + ranges_[v].begin, ranges_[v].size}; }

  // Room for other faces in the place of the vertex's. Spans of before are no longer valid.
  std::span<std::uint32_t> replace(VertexId v, std::size_t count) {
    Range& range = ranges_[v];
    if (count > range.size) {
      range.begin = static_cast<std::uint32_t>(pool_.size());
      pool_.resize(pool_.size() + count);
    }
    range.size = static_cast<std::uint32_t>(count);
    return {pool_.data() + range.begin, count};
  }

  void remove(VertexId v, std::uint32_t face) {
    Range& range = ranges_[v];
    const auto begin = pool_.begin() + range.begin;
    const auto end = begin + range.size;
    const auto found = std::find(begin, end, face);
    if (found == end) return;
    std::copy(found + 1, end, found);
    --range.size;
  }

 private:
  struct Range {  // in pool_
    std::uint32_t begin = 0;
    std::uint32_t size = 0;
  };
  std::vector<Range> ranges_;  // by vertex
  std::vector<std::uint32_t> pool_;
};

}  // namespace fanstream
