#include "server/build/merge_queue.h"

#include <algorithm>
#include <limits>

namespace fanstream {
namespace {

bool is_dearer(const MergeCandidate& x, const MergeCandidate& y) { return is_cheaper(y, x); }

}  // namespace

double MergeQueue::open(std::size_t wanted) {
  std::sort(judged_.begin(), judged_.end(), is_cheaper);
  std::size_t old = edges_.size();
  std::size_t fresh = judged_.size();
  edges_.resize(old + fresh);
  for (std::size_t to = edges_.size(); fresh > 0; --to) {  // merges from the back, in place
    const bool take_old = old > 0 && is_cheaper(judged_[fresh - 1], edges_[old - 1]);
    edges_[to - 1] = take_old ? edges_[--old] : judged_[--fresh];
  }
  judged_.clear();
  heap_.clear();
  next_ = 0;
  end_ = std::min(wanted, edges_.size());
  return end_ < edges_.size() ? edges_[end_].cost : std::numeric_limits<double>::infinity();
}

void MergeQueue::push(const MergeCandidate& candidate) {
  heap_.push_back(candidate);
  std::push_heap(heap_.begin(), heap_.end(), is_dearer);
}

bool MergeQueue::take_cheapest(MergeCandidate& best) {
  const bool sorted_left = next_ < end_;
  if (heap_.empty() && !sorted_left) return false;
  if (heap_.empty() || (sorted_left && is_cheaper(edges_[next_], heap_.front()))) {
    best = edges_[next_++];
    return true;
  }
  std::pop_heap(heap_.begin(), heap_.end(), is_dearer);
  best = heap_.back();
  heap_.pop_back();
  return true;
}

}  // namespace fanstream
