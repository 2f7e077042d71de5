#include "tests/bench/papers/fewest_fans.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/fans/ring_mesh.h"

namespace fanstream::bench {
namespace {

using Neighbours = std::vector<std::vector<VertexId>>;

Neighbours neighbours_of(std::size_t vertex_count, const std::vector<Triangle>& triangles) {
  Neighbours neighbours(vertex_count);
  for (const Triangle& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      neighbours[t[i]].push_back(t[(i + 1) % 3]);
      neighbours[t[i]].push_back(t[(i + 2) % 3]);
    }
  }
  for (std::vector<VertexId>& ring : neighbours) {
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
  }
  return neighbours;
}

// Takes in vertices one after another. Those that are in and have neighbours that are not are the front.
class Front {
 public:
  explicit Front(const Neighbours& neighbours) : neighbours_(neighbours), age_(neighbours.size(), 0) {
    for (const std::vector<VertexId>& ring : neighbours) outside_.push_back(ring.size());
  }

  bool contains(VertexId v) const { return age_[v] != 0; }
  bool is_done(VertexId v) const { return contains(v) && outside_[v] == 0; }
  const std::vector<VertexId>& vertices() const { return front_; }

  void take_in(VertexId v) {
    age_[v] = ++now_;
    for (const VertexId w : neighbours_[v]) --outside_[w];
    front_.push_back(v);
  }
  void drop(VertexId v) { front_.erase(std::find(front_.begin(), front_.end(), v)); }
  void drop_done() {
    front_.erase(std::remove_if(front_.begin(), front_.end(), [this](VertexId v) { return is_done(v); }), front_.end());
  }

  // Beside the front: which lets most vertices drop out, of equals the one beside the oldest.
  VertexId next() const {
    VertexId best = kOutside;
    Rank best_rank;
    for (const VertexId v : front_) {
      for (const VertexId w : neighbours_[v]) {
        if (contains(w)) continue;
        const Rank rank = rank_of(w);
        if (best == kOutside || rank.dropped > best_rank.dropped ||
            (rank.dropped == best_rank.dropped && rank.oldest < best_rank.oldest)) {
          best = w;
          best_rank = rank;
        }
      }
    }
    for (VertexId v = 0; best == kOutside && v < age_.size(); ++v) best = contains(v) ? best : v;  // another component
    return best;
  }

 private:
  struct Rank {
    std::size_t dropped = 0;
    std::size_t oldest = 0;
  };
  Rank rank_of(VertexId v) const {
    Rank rank{outside_[v] == 0 ? 1U : 0U, std::numeric_limits<std::size_t>::max()};
    for (const VertexId w : neighbours_[v]) {
      if (!contains(w)) continue;
      rank.dropped += outside_[w] == 1 ? 1 : 0;
      rank.oldest = std::min(rank.oldest, age_[w]);
    }
    return rank;
  }

  const Neighbours& neighbours_;
  std::vector<std::size_t> age_;  // 0: not taken in
  std::vector<std::size_t> outside_;
  std::vector<VertexId> front_;
  std::size_t now_ = 0;
};

// An order whose widest front is the narrowest of those that begin at each vertex; `widest` becomes its width. Empty if
// none is narrower than `widest` was, or equal.
std::vector<VertexId> narrow_order(const Neighbours& neighbours, std::size_t& widest) {
  std::vector<VertexId> best;
  for (VertexId start = 0; start < neighbours.size(); ++start) {
    Front front(neighbours);
    std::vector<VertexId> order;
    std::size_t width = 0;
    for (VertexId v = start; order.size() < neighbours.size() && width <= widest; v = front.next()) {
      front.take_in(v);
      order.push_back(v);
      width = std::max(width, front.vertices().size());
      front.drop_done();
    }
    if (order.size() < neighbours.size() || width > widest || (!best.empty() && width == widest)) continue;
    best = std::move(order);
    widest = width;
  }
  return best;
}

// By which of the front's vertices are centres (bit i: number i): how few centres there are so far.
class CenterCounts {
 public:
  void double_states() {
    const std::size_t size = fewest_.size();
    fewest_.resize(2 * size);
    for (std::size_t s = 0; s < size; ++s) fewest_[size + s] = static_cast<std::uint16_t>(fewest_[s] + 1);
  }
  void forbid_without(std::size_t any_of) {
    for (std::size_t s = 0; s < fewest_.size(); ++s) {
      if ((s & any_of) == 0) fewest_[s] = kImpossible;
    }
  }
  void forget(std::size_t number) {
    const std::size_t bit = std::size_t{1} << number;
    for (std::size_t s = 0; s < fewest_.size() / 2; ++s) {
      const std::size_t both = (s & (bit - 1)) | ((s & ~(bit - 1)) << 1U);
      fewest_[s] = std::min(fewest_[both], fewest_[both | bit]);
    }
    fewest_.resize(fewest_.size() / 2);
  }
  std::size_t fewest() const { return fewest_.front(); }

 private:
  static constexpr std::uint16_t kImpossible = 30'000;  // and a centre for each vertex more stays below 2^16
  std::vector<std::uint16_t> fewest_ = {0};
};

}  // namespace

std::size_t least_fans(std::size_t vertex_count, const std::vector<Triangle>& triangles) {
  std::vector<std::uint32_t> faces(vertex_count, 0);
  for (const Triangle& t : triangles) {
    for (const VertexId v : t) ++faces[v];
  }
  double shares = 0.0;
  for (const Triangle& t : triangles) shares += 1.0 / std::max({faces[t[0]], faces[t[1]], faces[t[2]]});
  return static_cast<std::size_t>(std::ceil(shares - 1e-6));
}

std::optional<std::size_t> fewest_centers(std::size_t vertex_count, const std::vector<Triangle>& triangles,
                                          std::size_t widest) {
  constexpr std::size_t kMostVertices = 20'000;
  if (vertex_count > kMostVertices) return {};
  const Neighbours neighbours = neighbours_of(vertex_count, triangles);
  const std::vector<VertexId> order = narrow_order(neighbours, widest);
  if (order.size() < vertex_count) return {};
  std::vector<std::vector<Triangle>> faces(vertex_count);
  for (const Triangle& t : triangles) {
    for (const VertexId v : t) faces[v].push_back(t);
  }
  Front front(neighbours);
  CenterCounts counts;
  const auto number = [&](VertexId v) {
    const std::vector<VertexId>& all = front.vertices();
    return static_cast<std::size_t>(std::find(all.begin(), all.end(), v) - all.begin());
  };
  for (const VertexId added : order) {
    front.take_in(added);
    counts.double_states();
    for (const Triangle& t : faces[added]) {
      if (!front.contains(t[0]) || !front.contains(t[1]) || !front.contains(t[2])) continue;
      counts.forbid_without((std::size_t{1} << number(t[0])) | (std::size_t{1} << number(t[1])) |
                            (std::size_t{1} << number(t[2])));
    }
    for (std::size_t i = front.vertices().size(); i-- > 0;) {
      const VertexId v = front.vertices()[i];
      if (!front.is_done(v)) continue;
      counts.forget(i);
      front.drop(v);
    }
  }
  return counts.fewest();
}

}  // namespace fanstream::bench
