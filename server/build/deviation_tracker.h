// How far each part of the surface is from the original, while merges are made.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <thread>

#include "common/fans/ring_mesh.h"
#include "server/build/merge_deviation.h"

namespace fanstream {

// Bounds add up along the merges of a place. Nothing that merges depend on is computed here, so it is done on a thread
// of its own where there is a second processor; the bounds are the same either way. add() and finish() are for one
// thread.
class DeviationTracker {
 public:
  // `places` of all vertices before the first merge.
  explicit DeviationTracker(std::span<const glm::dvec3> places);
  DeviationTracker(std::span<const glm::dvec3> places, bool own_thread);
  ~DeviationTracker();
  DeviationTracker(const DeviationTracker&) = delete;
  DeviationTracker& operator=(const DeviationTracker&) = delete;

  // The next merge. `ids` are the vertices of patch.ring, kOutside among them ignored.
  void add(VertexId root, VertexId removed, std::span<const VertexId> ids, const MergePatch& patch);

  // For each merge, in the order in which they were added: an upper bound of how far the surface around the merged
  // centre is from the original, and no smaller than that of any merge before it around there.
  std::vector<float> finish();

 private:
  struct Item {
    VertexId root;
    VertexId removed;
    std::uint32_t ring_size;
    std::uint32_t gap;
    std::uint32_t arc;
    glm::dvec3 merged;
  };
  struct Batch {
    std::vector<Item> items;
    std::vector<VertexId> ids;  // of all items
  };
  static constexpr std::size_t kBatchItems = 512;
  static constexpr std::size_t kMostBatches = 64;  // that wait: what bounds the memory

  void evaluate(VertexId root, VertexId removed, std::span<const VertexId> ids, const MergePatch& patch);
  void evaluate_batch(Batch& batch);
  void hand_over();
  void work();

  MergeDeviation deviation_;
  std::vector<float> by_vertex_;  // how far the faces around it may be off
  std::vector<float> results_;
  std::vector<glm::dvec3> places_;  // the thread's own: at the merge it is at
  std::vector<glm::dvec3> ring_;

  Batch filling_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<Batch> waiting_;
  std::vector<Batch> spare_;
  bool ended_ = false;
  std::thread worker_;
};

}  // namespace fanstream
