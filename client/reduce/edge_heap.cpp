#include "client/reduce/edge_heap.h"

#include <algorithm>

namespace fanstream {
namespace {

constexpr std::size_t kChildren = 4;

}  // namespace

float EdgeHeap::next_cost(float none) const {
  float least = none;
  for (std::size_t i = 1; i < std::min(entries_.size(), kChildren + 1); ++i) least = std::min(least, entries_[i].cost);
  return least;
}

void EdgeHeap::append(Edge edge, float cost) {
  entries_.push_back({cost, edge});
  place_[edge] = static_cast<std::uint32_t>(entries_.size() - 1);
}

void EdgeHeap::order_all() {
  if (entries_.size() < 2) return;
  for (std::size_t at = (entries_.size() - 2) / kChildren + 1; at-- > 0;) sink(at, Entry(entries_[at]));
}

void EdgeHeap::put(Edge edge, float cost) {
  const Entry entry{cost, edge};
  if (!holds(edge)) {
    entries_.push_back(entry);
    rise(entries_.size() - 1, entry);
    return;
  }
  const std::size_t at = place_[edge];
  if (before(entry, entries_[at])) {
    rise(at, entry);
  } else {
    sink(at, entry);
  }
}

void EdgeHeap::remove(Edge edge, std::uint32_t state) {
  const std::size_t at = place_[edge];
  const bool held = holds(edge);
  place_[edge] = state;
  if (!held) return;
  const Entry last = entries_.back();
  entries_.pop_back();
  if (at == entries_.size()) return;
  if (at > 0 && before(last, entries_[(at - 1) / kChildren])) {
    rise(at, last);
  } else {
    sink(at, last);
  }
}

void EdgeHeap::rise(std::size_t at, const Entry& entry) {
  while (at > 0) {
    const std::size_t parent = (at - 1) / kChildren;
    if (!before(entry, entries_[parent])) break;
    set(at, entries_[parent]);
    at = parent;
  }
  set(at, entry);
}

void EdgeHeap::sink(std::size_t at, const Entry& entry) {
  for (;;) {
    const std::size_t first = kChildren * at + 1;
    if (first >= entries_.size()) break;
    const std::size_t end = std::min(first + kChildren, entries_.size());
    std::size_t least = first;
    for (std::size_t child = first + 1; child < end; ++child) {
      if (before(entries_[child], entries_[least])) least = child;
    }
    if (!before(entries_[least], entry)) break;
    set(at, entries_[least]);
    at = least;
  }
  set(at, entry);
}

}  // namespace fanstream
