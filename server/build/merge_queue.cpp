#include "server/build/merge_queue.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

namespace fanstream {
namespace {

struct IsCheaper {
  bool operator()(const MergeCandidate& x, const MergeCandidate& y) const { return is_cheaper(x, y); }
};
struct IsDearer {
  bool operator()(const MergeCandidate& x, const MergeCandidate& y) const { return is_cheaper(y, x); }
};

struct CostKey {
  std::uint32_t high;  // the upper half of the cost's bits, which order like the costs themselves
  std::uint32_t index;
};

constexpr unsigned kDigitBits = 11;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;

void sort_by_digit(const std::vector<CostKey>& from, std::vector<CostKey>& to, unsigned shift) {
  std::array<std::uint32_t, kDigits> begin{};
  for (const CostKey& key : from) ++begin[(key.high >> shift) % kDigits];
  std::uint32_t sum = 0;
  for (std::uint32_t& count : begin) sum += std::exchange(count, sum);
  for (const CostKey& key : from) to[begin[(key.high >> shift) % kDigits]++] = key;
}

// By radix on half of the bits, which leaves few to be compared.
void sort_candidates(std::vector<MergeCandidate>& edges) {
  if (edges.size() < 2 * kDigits) {
    std::sort(edges.begin(), edges.end(), IsCheaper{});
    return;
  }
  std::vector<CostKey> keys(edges.size());
  std::vector<CostKey> scratch(edges.size());
  for (std::uint32_t i = 0; i < keys.size(); ++i) {
    keys[i] = {static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(edges[i].cost) >> 32U), i};
  }
  sort_by_digit(keys, scratch, 0);
  sort_by_digit(scratch, keys, kDigitBits);
  sort_by_digit(keys, scratch, 2 * kDigitBits);
  std::vector<MergeCandidate> sorted(edges.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) sorted[i] = edges[scratch[i].index];
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    for (end = begin + 1; end < sorted.size() && scratch[end].high == scratch[begin].high;) ++end;
    if (end > begin + 1) {
      std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(begin), sorted.begin() + static_cast<std::ptrdiff_t>(end),
                IsCheaper{});
    }
  }
  edges = std::move(sorted);
}

}  // namespace

double MergeQueue::open(std::size_t wanted) {
  sort_candidates(judged_);
  if (edges_.empty()) {
    edges_.swap(judged_);
  } else {
    std::size_t old = edges_.size();
    std::size_t fresh = judged_.size();
    edges_.resize(old + fresh);
    for (std::size_t to = edges_.size(); fresh > 0; --to) {  // merges from the back, in place
      const bool take_old = old > 0 && is_cheaper(judged_[fresh - 1], edges_[old - 1]);
      edges_[to - 1] = take_old ? edges_[--old] : judged_[--fresh];
    }
  }
  judged_.clear();
  heap_.clear();
  next_ = 0;
  end_ = std::min(wanted, edges_.size());
  return end_ < edges_.size() ? edges_[end_].cost : std::numeric_limits<double>::infinity();
}

void MergeQueue::push(const MergeCandidate& candidate) {
  heap_.push_back(candidate);
  std::push_heap(heap_.begin(), heap_.end(), IsDearer{});
}

bool MergeQueue::take_cheapest(MergeCandidate& best) {
  const bool sorted_left = next_ < end_;
  if (heap_.empty() && !sorted_left) return false;
  if (heap_.empty() || (sorted_left && is_cheaper(edges_[next_], heap_.front()))) {
    best = edges_[next_++];
    return true;
  }
  std::pop_heap(heap_.begin(), heap_.end(), IsDearer{});
  best = heap_.back();
  heap_.pop_back();
  return true;
}

}  // namespace fanstream
