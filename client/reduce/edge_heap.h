// Edges by cost, where any of them can get another cost or leave.
#pragma once

#include <cstdint>
#include <vector>

namespace fanstream {

// A heap of four children a node with the place of every edge. Ties by number, so that every machine reduces alike.
// Not thread safe.
class EdgeHeap {
 public:
  using Edge = std::uint32_t;
  // States of edges that are not in the heap; all below are places in it.
  static constexpr std::uint32_t kAbsent = 0xFFFFFFFFU;
  static constexpr std::uint32_t kFirstState = 0xFFFFFFF0U;

  explicit EdgeHeap(std::size_t edge_count) : place_(edge_count, kAbsent) {}

  bool empty() const { return entries_.empty(); }
  std::size_t size() const { return entries_.size(); }
  bool holds(Edge edge) const { return place_[edge] < kFirstState; }
  std::uint32_t state(Edge edge) const { return place_[edge]; }

  Edge top() const { return entries_.front().edge; }
  float top_cost() const { return entries_.front().cost; }
  // The least cost of all edges but the top; `none` if there is no other.
  float next_cost(float none) const;

  void reserve(std::size_t edges) { entries_.reserve(edges); }
  // Without order: order_all() must follow before anything else is asked.
  void append(Edge edge, float cost);
  void order_all();

  void put(Edge edge, float cost);                        // adds it, or changes its cost
  void remove(Edge edge, std::uint32_t state = kAbsent);  // state >= kFirstState; fine if it is not there

 private:
  struct Entry {
    float cost;
    Edge edge;
  };
  static bool before(const Entry& a, const Entry& b) { return a.cost != b.cost ? a.cost < b.cost : a.edge < b.edge; }
  void set(std::size_t at, const Entry& entry) {
    entries_[at] = entry;
    place_[entry.edge] = static_cast<std::uint32_t>(at);
  }
  void rise(std::size_t at, const Entry& entry);
  void sink(std::size_t at, const Entry& entry);

  std::vector<Entry> entries_;
  std::vector<std::uint32_t> place_;
};

}  // namespace fanstream
