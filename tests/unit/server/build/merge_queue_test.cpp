#include "server/build/merge_queue.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

// Edges between vertices of which some are closed; what take_cheapest() should do, done slowly.
struct Mesh {
  std::vector<std::uint32_t> changes;
  std::vector<bool> closed;

  bool is_stale(const MergeCandidate& edge) const { return edge.stamp != changes[edge.a] + changes[edge.b]; }
  bool is_open(const MergeCandidate& edge) const { return !is_stale(edge) && !closed[edge.a] && !closed[edge.b]; }
  bool is_unchanged(VertexId v, std::uint32_t count) const { return changes[v] == count; }
  void fetch_state(const MergeCandidate&) const {}
  void fetch_rings(const MergeCandidate&) const {}
  void fetch_places(const MergeCandidate&) const {}
};

class Reference {
 public:
  void add(const MergeCandidate& edge) { edges_.push_back(edge); }
  void begin_generation(std::size_t wanted, const Mesh& mesh) {
    std::erase_if(edges_, [&](const MergeCandidate& edge) { return mesh.is_stale(edge); });
    std::sort(edges_.begin(), edges_.end(), is_cheaper);
    open_.assign(edges_.begin(), edges_.begin() + static_cast<std::ptrdiff_t>(std::min(wanted, edges_.size())));
    limit_ = wanted < edges_.size() ? edges_[wanted].cost : std::numeric_limits<double>::infinity();
  }
  double limit() const { return limit_; }
  void put_back(const MergeCandidate& candidate) {
    if (candidate.cost <= limit_) open_.push_back(candidate);
  }
  bool take_cheapest(MergeCandidate& best, const Mesh& mesh) {
    std::erase_if(open_, [&](const MergeCandidate& edge) { return !mesh.is_open(edge); });
    const auto found = std::min_element(open_.begin(), open_.end(), is_cheaper);
    if (found == open_.end()) return false;
    best = *found;
    open_.erase(found);
    return true;
  }

 private:
  std::vector<MergeCandidate> edges_;
  std::vector<MergeCandidate> open_;
  double limit_ = 0.0;
};

class QueueBesideReference {
 public:
  QueueBesideReference(std::uint64_t seed, std::uint32_t vertices, std::uint32_t costs)
      : random_(seed),
        mesh_{std::vector<std::uint32_t>(vertices, 0), std::vector<bool>(vertices, false)},
        costs_(costs) {
    for (VertexId v = 0; v < vertices; ++v) {
      for (VertexId w = v + 1; w < std::min(vertices, v + 4); ++w) add(v, w);
    }
  }

  void run_generation(std::size_t wanted) {
    mesh_.closed.assign(mesh_.closed.size(), false);
    queue_.begin_generation(wanted, mesh_);
    reference_.begin_generation(wanted, mesh_);
    ASSERT_EQ(queue_.limit(), reference_.limit());
    for (int taken = 0;; ++taken) {
      MergeCandidate best;
      MergeCandidate expected;
      const bool found = queue_.take_cheapest(best, mesh_);
      ASSERT_EQ(found, reference_.take_cheapest(expected, mesh_)) << "after " << taken;
      if (!found) return;
      ASSERT_EQ(best.cost, expected.cost) << "after " << taken;
      ASSERT_EQ(best.a, expected.a);
      ASSERT_EQ(best.b, expected.b);
      ASSERT_EQ(best.weighed, expected.weighed);
      respond(best);
    }
  }

 private:
  MergeCandidate add(VertexId a, VertexId b) {
    const double cost = random_.below(costs_);
    const MergeCandidate edge{cost, a, b, mesh_.changes[a] + mesh_.changes[b], ParentPosition::kept, false};
    queue_.add(edge);
    reference_.add(edge);
    return edge;
  }

  // As the simplifier does: forget the candidate, put it back, or change one of its ends.
  void respond(MergeCandidate edge) {
    const std::uint32_t choice = random_.below(4);
    if (choice == 0) return;
    if (choice < 3 && !edge.weighed) {
      edge.cost += random_.below(5);
      edge.weighed = true;
      queue_.put_back(edge);
      reference_.put_back(edge);
      return;
    }
    const VertexId root = edge.a;
    mesh_.closed[edge.b] = true;
    ++mesh_.changes[root];
    std::vector<MergeCandidate> around;
    const auto count = static_cast<VertexId>(mesh_.changes.size());
    for (VertexId w = root >= 3 ? root - 3 : 0; w < std::min(count, root + 4); ++w) {
      if (w != root) around.push_back(add(std::min(root, w), std::max(root, w)));
    }
    queue_.open_around(root, mesh_.changes[root], around.size(), mesh_);
    for (const MergeCandidate& next : around) reference_.put_back(next);
  }

  testing::SeededRandom random_;
  Mesh mesh_;
  std::uint32_t costs_;
  MergeQueue queue_;
  Reference reference_;
};

TEST(MergeQueue, CandidatesComeCheapestFirst) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    QueueBesideReference both(seed, 40, seed % 2 == 0 ? 5 : 1000);  // many ties, and few
    for (const std::size_t wanted : {60U, 1000U, 20U}) both.run_generation(wanted);
  }
}

TEST(MergeQueue, ManyEdgesComeSorted) {
  for (const std::uint32_t costs : {1U, 50U, 1'000'000'000U}) {
    SCOPED_TRACE(std::to_string(costs) + " costs");
    testing::SeededRandom random(costs);
    const std::uint32_t vertices = 20'000;
    const Mesh mesh{std::vector<std::uint32_t>(vertices, 0), std::vector<bool>(vertices, false)};
    MergeQueue queue;
    for (VertexId v = 0; v + 1 < vertices; ++v) {
      queue.add({1e-3 * random.below(costs), v, v + 1, 0, ParentPosition::kept, false});
    }
    queue.begin_generation(vertices, mesh);
    MergeCandidate before;
    MergeCandidate next;
    ASSERT_TRUE(queue.take_cheapest(before, mesh));
    std::uint32_t count = 1;
    for (; queue.take_cheapest(next, mesh); before = next, ++count) ASSERT_TRUE(is_cheaper(before, next));
    EXPECT_EQ(count, vertices - 1);
  }
}

}  // namespace
}  // namespace fanstream
