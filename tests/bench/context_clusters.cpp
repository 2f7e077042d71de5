#include "tests/bench/context_clusters.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace fanstream::bench {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

SymbolCounts joined(const SymbolCounts& a, const SymbolCounts& b) {
  SymbolCounts sum = a;
  for (std::size_t s = 0; s < sum.size(); ++s) sum[s] += b[s];
  return sum;
}

double bits_of(const SymbolCounts& counts) {
  double sum = 0.0;
  double bits = 0.0;
  for (const double c : counts) {
    if (c > 0.0) bits -= c * std::log2(c);
    sum += c;
  }
  return sum > 0.0 ? bits + sum * std::log2(sum) : 0.0;
}

class Joining {
 public:
  Joining(std::span<const SymbolCounts> counts, std::span<const int> kinds)
      : counts_(counts.begin(), counts.end()),
        kinds_(kinds.begin(), kinds.end()),
        distances_(counts.size() * counts.size(), kFar),
        nearest_(counts.size(), 0),
        cluster_(counts.size()),
        left_(counts.size()) {
    const std::size_t n = counts_.size();
    for (std::size_t i = 0; i < n; ++i) {
      cluster_[i] = static_cast<std::uint32_t>(i);
      bits_.push_back(bits_of(counts_[i]));
    }
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < i; ++j) set_distance(i, j);
    }
    for (std::size_t i = 0; i < n; ++i) find_nearest(i);
  }

  std::size_t left() const { return left_; }

  // False if there is nothing to join.
  bool join_nearest() {
    std::size_t a = 0;
    for (std::size_t i = 1; i < counts_.size(); ++i) {
      if (distance(i, nearest_[i]) < distance(a, nearest_[a])) a = i;
    }
    const std::size_t b = nearest_[a];
    if (distance(a, b) == kFar) return false;
    counts_[a] = joined(counts_[a], counts_[b]);
    bits_[a] = bits_of(counts_[a]);
    kinds_[b] = kGone;
    std::replace(cluster_.begin(), cluster_.end(), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(a));
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (i != b) set_distance(i, b);
      if (i != a) set_distance(i, a);
    }
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (i == a || i == b || nearest_[i] == a || nearest_[i] == b) {
        find_nearest(i);
      } else if (distance(i, a) < distance(i, nearest_[i])) {
        nearest_[i] = a;
      }
    }
    --left_;
    return true;
  }

  const std::vector<std::uint32_t>& clusters() const { return cluster_; }

 private:
  static constexpr int kGone = -1;
  double distance(std::size_t i, std::size_t j) const { return distances_[i * counts_.size() + j]; }
  void set_distance(std::size_t i, std::size_t j) {
    const bool alike = kinds_[i] == kinds_[j] && kinds_[i] != kGone;
    const double more = alike ? bits_of(joined(counts_[i], counts_[j])) - bits_[i] - bits_[j] : kFar;
    distances_[i * counts_.size() + j] = distances_[j * counts_.size() + i] = more;
  }
  void find_nearest(std::size_t i) {
    const auto row = distances_.begin() + static_cast<std::ptrdiff_t>(i * counts_.size());
    nearest_[i] =
        static_cast<std::size_t>(std::min_element(row, row + static_cast<std::ptrdiff_t>(counts_.size())) - row);
  }

  std::vector<SymbolCounts> counts_;
  std::vector<double> bits_;
  std::vector<int> kinds_;
  std::vector<double> distances_;
  std::vector<std::size_t> nearest_;
  std::vector<std::uint32_t> cluster_;
  std::size_t left_;
};

// Renumbers from 0 in the order of the first contexts.
void renumber(std::vector<std::uint32_t>& cluster) {
  std::map<std::uint32_t, std::uint32_t> numbers;
  for (std::uint32_t& c : cluster) c = numbers.try_emplace(c, static_cast<std::uint32_t>(numbers.size())).first->second;
}

// Each context to the cluster of its kind whose table suits it best. False if all are there already.
bool move_contexts(std::span<const SymbolCounts> counts, std::span<const int> kinds,
                   std::vector<std::uint32_t>& cluster) {
  const std::size_t clusters = *std::max_element(cluster.begin(), cluster.end()) + std::size_t{1};
  std::vector<SymbolCounts> costs(clusters);
  std::vector<int> kind(clusters, 0);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    costs[cluster[i]] = joined(costs[cluster[i]], counts[i]);
    kind[cluster[i]] = kinds[i];
  }
  for (SymbolCounts& c : costs) {
    double sum = 0.0;
    for (double& x : c) sum += (x += 1e-3);
    for (double& x : c) x = std::log2(sum / x);
  }
  bool moved = false;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    double least = kFar;
    std::uint32_t best = cluster[i];
    for (std::uint32_t c = 0; c < clusters; ++c) {
      if (kind[c] != kinds[i]) continue;
      double bits = 0.0;
      for (std::size_t s = 0; s < counts[i].size(); ++s) bits += counts[i][s] * costs[c][s];
      if (bits < least) {
        least = bits;
        best = c;
      }
    }
    moved = moved || best != cluster[i];
    cluster[i] = best;
  }
  return moved;
}

}  // namespace

std::vector<std::uint32_t> cluster_contexts(std::span<const SymbolCounts> counts, std::span<const int> kinds,
                                            std::size_t clusters) {
  Joining joining(counts, kinds);
  while (joining.left() > clusters && joining.join_nearest()) {
  }
  std::vector<std::uint32_t> result = joining.clusters();
  renumber(result);
  constexpr int kMostRounds = 20;
  for (int round = 0; round < kMostRounds && move_contexts(counts, kinds, result); ++round) {
  }
  renumber(result);
  return result;
}

}  // namespace fanstream::bench
