// The edges of a mesh in the order in which a generation of merges tries them.
#pragma once

#include <cstdint>
#include <vector>

#include "common/fans/fan_split.h"

namespace fanstream {

struct MergeCandidate {
  double cost = 0.0;  // never negative
  VertexId a = 0;
  VertexId b = 0;
  std::uint32_t stamp = 0;                       // tells whether an end has changed since it was judged
  ParentPosition parent = ParentPosition::kept;  // with `a` as the root
  bool weighed = false;                          // it may be merged, and the cost includes what its coding takes
};

// By cost; ties by number, so that every machine makes the same model.
inline bool is_cheaper(const MergeCandidate& x, const MergeCandidate& y) {
  if (x.cost != y.cost) return x.cost < y.cost;
  return x.a != y.a ? x.a < y.a : x.b < y.b;
}

// All edges, sorted from generation to generation, and a heap of those that come up within one. Not thread safe.
class MergeQueue {
 public:
  // An edge as it has been judged; seen from the next generation on.
  void add(const MergeCandidate& edge) { judged_.push_back(edge); }

  // Drops the edges for which is_stale(edge), sorts in those added, and opens the cheapest `wanted` edges. Returns the
  // cost from which on edges are left out, infinite if none is.
  template <class IsStale>
  double begin_generation(std::size_t wanted, IsStale&& is_stale) {
    drop_stale(edges_, is_stale);
    drop_stale(judged_, is_stale);
    return open(wanted);
  }

  // Takes part in this generation only.
  void push(const MergeCandidate& candidate);
  // The cheapest candidate left; false if there is none.
  bool take_cheapest(MergeCandidate& best);

  // The edge that comes `distance` after the next one unless others are pushed before it, or nullptr.
  const MergeCandidate* ahead(std::size_t distance) const {
    return next_ + distance < end_ ? &edges_[next_ + distance] : nullptr;
  }
  const MergeCandidate* cheapest_pushed() const { return heap_.empty() ? nullptr : &heap_.front(); }

 private:
  // Without a branch on what is stale, which no processor could foresee.
  template <class IsStale>
  static void drop_stale(std::vector<MergeCandidate>& edges, IsStale&& is_stale) {
    std::size_t kept = 0;
    for (const MergeCandidate& edge : edges) {
      const MergeCandidate copy = edge;
      edges[kept] = copy;
      kept += is_stale(copy) ? 0 : 1;
    }
    edges.resize(kept);
  }
  double open(std::size_t wanted);

  std::vector<MergeCandidate> edges_;   // sorted
  std::vector<MergeCandidate> judged_;  // since the generation began
  std::vector<MergeCandidate> heap_;
  std::size_t next_ = 0;  // into edges_
  std::size_t end_ = 0;
};

}  // namespace fanstream
