#include "server/build/merge_queue.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace fanstream {
namespace {

struct IsCheaper {
  bool operator()(const MergeCandidate& x, const MergeCandidate& y) const { return is_cheaper(x, y); }
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

void MergeQueue::open(std::size_t wanted) {
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
  put_back_.clear();
  groups_.clear();
  heap_.clear();
  taken_.group = kNoGroup;
  next_ = 0;
  ahead_count_ = 0;
  end_ = std::min(wanted, edges_.size());
  limit_ = end_ < edges_.size() ? edges_[end_].cost : std::numeric_limits<double>::infinity();
}

void MergeQueue::put_back(const MergeCandidate& candidate) {
  if (candidate.cost > limit_) return;
  put_back_.push_back(candidate);
  push({candidate.cost, static_cast<std::uint32_t>(put_back_.size() - 1), kNoGroup});
}

void MergeQueue::push(const Entry& entry) {
  heap_.push_back(entry);
  std::push_heap(heap_.begin(), heap_.end(), dearer());
}

void MergeQueue::pop(MergeCandidate& best) {
  std::pop_heap(heap_.begin(), heap_.end(), dearer());
  taken_ = heap_.back();
  best = candidate_of(taken_);
  heap_.pop_back();
}

}  // namespace fanstream
