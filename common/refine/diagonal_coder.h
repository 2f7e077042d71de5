// Which edges around some vertices of the full model are diagonals of the source's polygons, coded with what both ends
// know of the mesh there.
//
// An edge belongs to that of its vertices that has the lower number in the asset, and with it to a block of vertices. A
// block is coded by itself: its edges in the order of their vertices' numbers, boundary edges left out, since they are
// never diagonals. All that is looked at are the rings of the block's own vertices and the places of their neighbours,
// so a block can be decoded as soon as these are the full model's, whatever the rest of the mesh is.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "common/coding/diagonal_model.h"
#include "common/refine/fan_state.h"

namespace fanstream {

// The two ends of an edge by their numbers in the asset, the lower one in the high word: in their order, edges lie as
// they are coded.
inline std::uint64_t edge_key(VertexId a, VertexId b) { return std::uint64_t{std::min(a, b)} << 32U | std::max(a, b); }

// Keeps references to its arguments. Not thread safe.
class DiagonalCoder {
 public:
  // `unit`: PositionGrid::unit(). `numbers`: by vertex of the state its number in the asset; empty: the same.
  DiagonalCoder(const FanState& state, const glm::vec3& unit, std::span<const VertexId> numbers = {})
      : state_(state), unit_(unit), numbers_(numbers) {}

  // `decide(context, key)` codes one edge and returns whether it is a diagonal. Precondition: the numbers of `vertices`
  // ascend, they and their neighbours are never split again. The block's diagonals, ascending, are appended to
  // `diagonals`.
  template <class Decide>
  void code(std::span<const VertexId> vertices, Decide&& decide, std::vector<std::uint64_t>& diagonals) {
    known_.clear();
    for (const VertexId u : vertices) {
      begin_ring(u);
      for (const std::uint32_t i : order_) {
        const VertexId v = ring_[i];
        const std::uint64_t key = key_of(u, v);
        const bool diagonal = decide(context(u, i), key);
        known_.push_back({key, diagonal});
        if (diagonal) diagonals.push_back(key);
      }
    }
  }

 private:
  struct Known {
    std::uint64_t key;
    bool diagonal;
  };

  VertexId number(VertexId v) const { return numbers_.empty() ? v : numbers_[v]; }
  std::uint64_t key_of(VertexId a, VertexId b) const { return edge_key(number(a), number(b)); }

  // The places in u's ring of the ends of inner edges that belong to u, by their numbers.
  void begin_ring(VertexId u) {
    ring_ = state_.fans.ring(u);
    order_.clear();
    for (std::uint32_t i = 0; i < ring_.size(); ++i) {
      if (ring_[i] == kOutside || before(i) == kOutside || after(i) == kOutside) continue;
      if (number(ring_[i]) > number(u)) order_.push_back(i);
    }
    std::sort(order_.begin(), order_.end(),
              [this](std::uint32_t a, std::uint32_t b) { return number(ring_[a]) < number(ring_[b]); });
  }
  VertexId before(std::uint32_t i) const { return ring_[i == 0 ? ring_.size() - 1 : i - 1]; }
  VertexId after(std::uint32_t i) const { return ring_[i + 1 == ring_.size() ? 0 : i + 1]; }

  glm::dvec3 place(VertexId v) const {
    const GridPoint& code = state_.vertices[v].place;
    return {double(code.x) * double(unit_.x), double(code.y) * double(unit_.y), double(code.z) * double(unit_.z)};
  }

  // Whether an edge is known to be a diagonal (1), or to be none (0); -1 where nothing is known.
  int known(VertexId a, VertexId b) const {
    const std::uint64_t key = key_of(a, b);
    const auto at = std::lower_bound(known_.begin(), known_.end(), key,
                                     [](const Known& k, std::uint64_t wanted) { return k.key < wanted; });
    return at == known_.end() || at->key != key ? -1 : at->diagonal ? 1 : 0;
  }
  DiagonalContext::Side side(VertexId u, VertexId v, VertexId apex) const {
    const int a = known(u, apex);
    const int b = known(v, apex);
    if (a == 1 || b == 1) return DiagonalContext::has_one;
    if (a == 0 && b == 0) return DiagonalContext::both_none;
    return a == 0 || b == 0 ? DiagonalContext::one_none : DiagonalContext::unknown;
  }

  // Of the edge from u to place i of its ring.
  std::size_t context(VertexId u, std::uint32_t i) const {
    const VertexId v = ring_[i];
    DiagonalContext c;
    c.sides = {side(u, v, before(i)), side(u, v, after(i))};
    const glm::dvec3 from = place(u);
    const glm::dvec3 edge = place(v) - from;
    const glm::dvec3 right = place(before(i)) - from;
    const glm::dvec3 left = place(after(i)) - from;
    const auto is_longest = [&](const glm::dvec3& other) {
      return square(edge) >= square(other) && square(edge) >= square(other - edge) ? 1 : 0;
    };
    c.longest = static_cast<std::uint8_t>(is_longest(right) + is_longest(left));
    c.flatness = flatness(cross(right, edge), cross(edge, left));
    return c.number();
  }

  // Written out, since builder and client have to come to the same bits (CODING.md, section 10).
  static double dot(const glm::dvec3& a, const glm::dvec3& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
  static double square(const glm::dvec3& a) { return dot(a, a); }
  static glm::dvec3 cross(const glm::dvec3& a, const glm::dvec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }
  static std::uint8_t flatness(const glm::dvec3& a, const glm::dvec3& b) {
    const double d = dot(a, b);
    const double lengths = square(a) * square(b);
    if (d <= 0.0 || d * d < 0.75 * lengths) return 0;
    return d * d < 0.98 * lengths ? 1 : 2;
  }

  const FanState& state_;
  glm::vec3 unit_;
  std::span<const VertexId> numbers_;
  std::vector<VertexId> ring_;        // of the vertex at hand
  std::vector<std::uint32_t> order_;  // places in it
  std::vector<Known> known_;          // of the block, in the order of keys
};

}  // namespace fanstream
