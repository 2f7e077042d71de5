// The edges of a mesh in the order in which a generation of merges tries them.
#pragma once

#include <algorithm>
#include <array>
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

// All edges, sorted from generation to generation, and a heap of what comes up within one: of the edges around a root
// only the cheapest is in the heap. Mesh is what knows the state of things:
//   bool is_stale(const MergeCandidate&)           an end has changed since it was judged
//   bool is_open(const MergeCandidate&)            it is not stale and may be merged; not so again, once it is not
//   bool is_unchanged(VertexId, std::uint32_t)     since it had changed so many times
//   void fetch_state(const MergeCandidate&)        the above will soon be asked about it
//   void fetch_rings(const MergeCandidate&)        it may soon be taken; follows fetch_state
//   void fetch_places(const MergeCandidate&)       likewise; follows fetch_rings
// Not thread safe.
class MergeQueue {
 public:
  // Another edge, for the generations to come.
  void add(const MergeCandidate& edge) { judged_.push_back(edge); }
  void add(const std::vector<MergeCandidate>& edges) { judged_.insert(judged_.end(), edges.begin(), edges.end()); }

  // Drops stale edges, sorts in those added, and opens the cheapest `wanted` edges.
  template <class Mesh>
  void begin_generation(std::size_t wanted, const Mesh& mesh) {
    drop_stale(edges_, mesh);
    drop_stale(judged_, mesh);
    open(wanted);
  }

  // The cost from which on edges are left out of this generation; infinite if none is.
  double limit() const { return limit_; }

  // Opens the edges that have been added last, `count` of them: those around `root`, after it had changed so many
  // times.
  template <class Mesh>
  void open_around(VertexId root, std::uint32_t changes, std::size_t count, const Mesh& mesh) {
    groups_.push_back({root, changes, static_cast<std::uint32_t>(judged_.size() - count),
                       static_cast<std::uint32_t>(judged_.size())});
    push_next(static_cast<std::uint32_t>(groups_.size() - 1), nullptr, mesh);
  }

  // Brings a candidate back into this generation at another cost, if that is within the limit.
  void put_back(const MergeCandidate& candidate);

  // The cheapest open candidate; false if there is none.
  template <class Mesh>
  bool take_cheapest(MergeCandidate& best, const Mesh& mesh) {
    for (;;) {
      advance_group(mesh);
      look_ahead(mesh);
      if (ahead_count_ != 0 && (heap_.empty() || is_cheaper(edges_[ahead_[0]], candidate_of(heap_.front())))) {
        best = edges_[ahead_[0]];
        --ahead_count_;
        std::copy_n(ahead_.begin() + 1, ahead_count_, ahead_.begin());
        if (ahead_count_ > kPlacesAhead) mesh.fetch_places(edges_[ahead_[kPlacesAhead]]);
      } else {
        if (heap_.empty()) return false;
        pop(best);
        for (std::size_t i = 0; i < std::min<std::size_t>(heap_.size(), 3); ++i)
          mesh.fetch_state(candidate_of(heap_[i]));
        if (!heap_.empty() && mesh.is_open(candidate_of(heap_.front()))) mesh.fetch_places(candidate_of(heap_.front()));
      }
      if (mesh.is_open(best)) return true;
    }
  }

 private:
  static constexpr std::uint32_t kNoGroup = 0xFFFFFFFFU;
  // How far ahead memory is fetched: of all edges, and of those that are open.
  static constexpr std::size_t kStateAhead = 16;
  static constexpr std::size_t kOpenAhead = 8;
  static constexpr std::size_t kPlacesAhead = 3;

  struct Group {  // the edges around a root, judged at the same time: judged_[begin, end)
    VertexId root;
    std::uint32_t changes;
    std::uint32_t begin;
    std::uint32_t end;
  };
  struct Entry {
    double cost;
    std::uint32_t index;  // into judged_, or into put_back_
    std::uint32_t group;  // or kNoGroup
  };

  // Without a branch on what is stale, which no processor could foresee.
  template <class Mesh>
  static void drop_stale(std::vector<MergeCandidate>& edges, const Mesh& mesh) {
    std::size_t kept = 0;
    for (const MergeCandidate& edge : edges) {
      const MergeCandidate copy = edge;
      edges[kept] = copy;
      kept += mesh.is_stale(copy) ? 0 : 1;
    }
    edges.resize(kept);
  }

  // Finds the next open edges. Most are closed by the time they are reached, and what is closed stays so.
  template <class Mesh>
  void look_ahead(const Mesh& mesh) {
    for (; ahead_count_ < kOpenAhead && next_ < end_; ++next_) {
      if (next_ + kStateAhead < end_) mesh.fetch_state(edges_[next_ + kStateAhead]);
      if (!mesh.is_open(edges_[next_])) continue;
      mesh.fetch_rings(edges_[next_]);
      ahead_[ahead_count_++] = static_cast<std::uint32_t>(next_);
    }
  }

  // What was taken last has either been merged, which replaces its group, or the next of that group has its turn.
  template <class Mesh>
  void advance_group(const Mesh& mesh) {
    if (taken_.group == kNoGroup) return;
    const Group& group = groups_[taken_.group];
    if (mesh.is_unchanged(group.root, group.changes)) push_next(taken_.group, &judged_[taken_.index], mesh);
    taken_.group = kNoGroup;
  }

  // The cheapest open edge of the group that comes after `last`.
  template <class Mesh>
  void push_next(std::uint32_t group, const MergeCandidate* last, const Mesh& mesh) {
    const MergeCandidate* best = nullptr;
    for (std::uint32_t i = groups_[group].begin; i < groups_[group].end; ++i) {
      const MergeCandidate& edge = judged_[i];
      if (edge.cost > limit_ || (best != nullptr && is_cheaper(*best, edge))) continue;
      if (last != nullptr && !is_cheaper(*last, edge)) continue;
      if (mesh.is_open(edge)) best = &edge;
    }
    if (best != nullptr) push({best->cost, static_cast<std::uint32_t>(best - judged_.data()), group});
  }

  const MergeCandidate& candidate_of(const Entry& entry) const {
    return entry.group == kNoGroup ? put_back_[entry.index] : judged_[entry.index];
  }
  void open(std::size_t wanted);
  // Orders the heap with the cheapest on top.
  auto dearer() const {
    return [this](const Entry& x, const Entry& y) {
      return x.cost != y.cost ? x.cost > y.cost : is_cheaper(candidate_of(y), candidate_of(x));
    };
  }
  void push(const Entry& entry);
  void pop(MergeCandidate& best);

  std::vector<MergeCandidate> edges_;   // sorted
  std::vector<MergeCandidate> judged_;  // since the generation began
  std::vector<MergeCandidate> put_back_;
  std::vector<Group> groups_;
  std::vector<Entry> heap_;
  Entry taken_{0.0, 0, kNoGroup};
  std::size_t next_ = 0;  // into edges_
  std::size_t end_ = 0;
  std::array<std::uint32_t, kOpenAhead> ahead_{};  // the open ones before next_
  std::size_t ahead_count_ = 0;
  double limit_ = 0.0;
};

}  // namespace fanstream
