#include "server/build/deviation_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <system_error>

#include "server/build/prefetch.h"
#include "server/build/processors.h"

namespace fanstream {

DeviationTracker::DeviationTracker(std::span<const glm::dvec3> places)
    : DeviationTracker(places, places.size() > 32 * kBatchItems && usable_processors() > 1) {}

DeviationTracker::DeviationTracker(std::span<const glm::dvec3> places, bool own_thread)
    : by_vertex_(places.size(), 0.0F) {
  if (!own_thread) return;
  places_.assign(places.begin(), places.end());
  try {
    worker_ = std::thread([this] { work(); });
  } catch (const std::system_error&) {
    // No thread to be had: the merges' own will do.
  }
}

DeviationTracker::~DeviationTracker() { finish(); }

void DeviationTracker::add(VertexId root, VertexId removed, std::span<const VertexId> ids, const MergePatch& patch) {
  if (!worker_.joinable()) {
    evaluate(root, removed, ids, patch);
    return;
  }
  filling_.items.push_back({root, removed, static_cast<std::uint32_t>(ids.size()),
                            static_cast<std::uint32_t>(patch.gap), static_cast<std::uint32_t>(patch.arc),
                            patch.merged});
  filling_.ids.insert(filling_.ids.end(), ids.begin(), ids.end());
  if (filling_.items.size() == kBatchItems) hand_over();
}

std::vector<float> DeviationTracker::finish() {
  if (worker_.joinable()) {
    hand_over();
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
    worker_.join();
  }
  return std::move(results_);
}

void DeviationTracker::hand_over() {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_.size() < kMostBatches; });
    waiting_.push_back(std::move(filling_));
    filling_ = {};
    if (!spare_.empty()) {
      filling_ = std::move(spare_.back());
      spare_.pop_back();
    }
  }
  changed_.notify_all();
}

void DeviationTracker::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    Batch batch = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    changed_.notify_all();
    evaluate_batch(batch);
    lock.lock();
    spare_.push_back(std::move(batch));
  }
}

void DeviationTracker::evaluate_batch(Batch& batch) {
  std::size_t begin = 0;
  for (const Item& item : batch.items) {
    const auto ids = std::span<const VertexId>(batch.ids).subspan(begin, item.ring_size);
    ring_.assign(ids.size(), item.merged);
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (ids[i] != kOutside) ring_[i] = places_[ids[i]];
    }
    evaluate(item.root, item.removed, ids,
             {ring_, item.gap, item.arc, places_[item.root], places_[item.removed], item.merged});
    places_[item.root] = item.merged;
    begin += item.ring_size;
  }
  batch.items.clear();
  batch.ids.clear();
}

// Each face around the two centres has the deviation of its worst corner.
void DeviationTracker::evaluate(VertexId root, VertexId removed, std::span<const VertexId> ids,
                                const MergePatch& patch) {
  for (const VertexId w : ids) {
    if (w != kOutside) prefetch(&by_vertex_[w]);
  }
  const double moved = deviation_.bound(patch);
  float worst = std::max(by_vertex_[root], by_vertex_[removed]);
  for (const VertexId w : ids) {
    if (w != kOutside) worst = std::max(worst, by_vertex_[w]);
  }
  const double sum = worst + moved;
  // Rounded up, so that it stays a bound.
  by_vertex_[root] = std::nextafter(static_cast<float>(sum), std::numeric_limits<float>::infinity());
  results_.push_back(by_vertex_[root]);
}

}  // namespace fanstream
