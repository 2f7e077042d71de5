#include "client/view/budget_cut.h"

#include <algorithm>
#include <bit>
#include <cassert>

namespace fanstream {
namespace {

// Positive floats order as their bits do; the top twelve are sixteenths of octaves.
constexpr std::size_t kBuckets = 4096;
std::size_t bucket_of(float level) { return std::bit_cast<std::uint32_t>(level) >> 19U; }

}  // namespace

void BudgetCut::clear() {
  entries_.clear();
  total_cost_ = 0;
}

void BudgetCut::add(float level, std::uint64_t cost) {
  assert(level > 0.0F);
  entries_.push_back({level, cost});
  total_cost_ += cost;
}

float BudgetCut::lowest_level(std::uint64_t room) {
  if (total_cost_ <= room) return 0.0F;
  bucket_costs_.assign(kBuckets, 0);
  for (const Entry& entry : entries_) bucket_costs_[bucket_of(entry.level)] += entry.cost;
  std::size_t bucket = kBuckets;
  while (bucket_costs_[--bucket] <= room) room -= bucket_costs_[bucket];
  border_.clear();
  for (const Entry& entry : entries_) {
    if (bucket_of(entry.level) == bucket) border_.push_back(entry);
  }
  std::sort(border_.begin(), border_.end(), [](const Entry& a, const Entry& b) { return a.level > b.level; });
  for (std::size_t i = 0;;) {
    std::uint64_t cost = 0;
    const float level = border_[i].level;
    while (i < border_.size() && border_[i].level == level) cost += border_[i++].cost;
    if (cost > room) return level;
    room -= cost;
  }
}

}  // namespace fanstream
