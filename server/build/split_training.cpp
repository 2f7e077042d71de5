#include "server/build/split_training.h"

#include <algorithm>
#include <cmath>

namespace fanstream {
namespace {

constexpr int kFeatures = PredictionContexts::kFeatures;
constexpr double kLeastSamples = 24.0;

// Normal equations of one prediction class, pulled towards the built-in weights so that few samples cannot run away.
struct LeastSquares {
  std::array<std::array<double, kFeatures>, kFeatures> a{};
  std::array<double, kFeatures> b{};
  double count = 0.0;

  void add(const RingFeatures& f, Float4 target, double weight) {
    for (std::size_t i = 0; i < kFeatures; ++i) {
      for (std::size_t j = 0; j < kFeatures; ++j) a[i][j] += weight * dot3(f.features[i], f.features[j]);
      b[i] += weight * dot3(f.features[i], target);
    }
    count += 1.0;
  }

  std::array<double, kFeatures> solve(std::array<std::int8_t, kFeatures> prior) const {
    auto m = a;
    auto x = b;
    for (std::size_t i = 0; i < kFeatures; ++i) {
      m[i][i] += 2.0;
      x[i] += 2.0 * prior[i] / 64.0;
    }
    for (std::size_t i = 0; i < kFeatures; ++i) {  // positive definite: no pivoting needed
      for (std::size_t j = i + 1; j < kFeatures; ++j) {
        const double factor = m[j][i] / m[i][i];
        for (std::size_t k = i; k < kFeatures; ++k) m[j][k] -= factor * m[i][k];
        x[j] -= factor * x[i];
      }
    }
    for (std::size_t i = kFeatures; i-- > 0;) {
      for (std::size_t k = i + 1; k < kFeatures; ++k) x[i] -= m[i][k] * x[k];
      x[i] /= m[i][i];
    }
    return x;
  }
};

// A spread stands for this part of it as the mean distance; a little less than a logistic distribution's, whose tails
// are too short.
constexpr double kMeanDistance = 1.0 / 1.372;

// Bits that a distance takes, in terms of the mean one: of an exponential distribution, which is good enough to
// compare.
double distance_bits(double distance) { return 1.44269504088896341 * distance / kMeanDistance; }

// Finds by how many 8ths of an octave a spread should be wider, from distances in terms of what it is.
class SpreadFit {
 public:
  void add(double distance) {
    sum_ += distance;
    count_ += 1.0;
  }
  double count() const { return count_; }
  int wider() const {
    const double factor = sum_ / count_ / kMeanDistance;
    return static_cast<int>(std::clamp(std::lround(8.0 * std::log2(std::max(factor, 1e-6))), -40L, 40L));
  }
  double saved_bits() const {
    return distance_bits(sum_) - distance_bits(sum_ * std::exp2(-wider() / 8.0)) - count_ * wider() / 8.0;
  }

 private:
  double sum_ = 0.0;
  double count_ = 0.0;
};

// What a number takes in an asset that differs from the built-in one.
double number_bits(int difference) { return 2.2 + 0.6 * std::abs(difference); }
constexpr double kGroupBits = 2.8;  // and a group of such

double spread_of(int eighths) { return std::exp2(eighths / 8.0); }

void replace(std::int8_t& eighths, const SpreadFit& fit, bool at_a_price, std::size_t stride) {
  if (fit.count() < kLeastSamples) return;
  const double price = at_a_price ? kGroupBits + number_bits(fit.wider()) : 0.0;
  if (static_cast<double>(stride) * fit.saved_bits() <= price) return;
  eighths = static_cast<std::int8_t>(std::clamp(eighths + fit.wider(), -48, 120));
}

}  // namespace

CountingCoder::Counts tied_counts(const CountingCoder::Counts& untied) {
  CountingCoder::Counts counts(SymbolContexts::kTables);
  for (std::size_t i = 0; i < untied.size(); ++i) {
    const auto phase = static_cast<int>(i) / SymbolContexts::kContexts;
    const auto context = static_cast<int>(i) % SymbolContexts::kContexts;
    auto& table = counts[static_cast<std::size_t>(SymbolContexts::table_of(phase, context))];
    for (std::size_t s = 0; s < table.size(); ++s) table[s] += untied[i][s];
  }
  return counts;
}

void GeometryTraining::observe(const RingGeometry& ring, const FanSplit& split, const glm::vec3& unit, int phase) {
  if (seen_++ % stride_ != 0) return;
  const float sign = split.parent == ParentPosition::added ? -1.0F : 1.0F;
  samples_.push_back({ring_features(ring, split), float4(sign * glm::vec3(split.displacement) * unit), ring.normal(),
                      ring.mean_square(), ring.bend_square(), ring.is_open(), static_cast<std::uint8_t>(phase)});
  if (split.parent != ParentPosition::free) return;
  shifts_.push_back({samples_.back(), float4(glm::vec3(split.shift) * unit)});
}

void GeometryTraining::add(const GeometryTraining& other, std::size_t most_samples) {
  const std::size_t stride = 1 + other.samples_.size() / most_samples;
  for (std::size_t i = 0; i < other.samples_.size(); i += stride) samples_.push_back(other.samples_[i]);
  for (std::size_t i = 0; i < other.shifts_.size(); i += stride) shifts_.push_back(other.shifts_[i]);
}

void GeometryTraining::learn(SplitStatistics& statistics, bool at_a_price) const {
  learn_weights(statistics, at_a_price);
  learn_spreads(statistics, at_a_price);
  learn_scales(statistics, at_a_price);
  if (statistics.has_free_parents) learn_shifts(statistics.free_parent);
}

void GeometryTraining::learn_built_in(SplitStatistics& statistics) const {
  for (int round = 0; round < 4; ++round) learn(statistics, false);
}

GeometryTraining::Off GeometryTraining::off(const Sample& s, const Weights& weights) {
  Float4 mean{};
  for (std::size_t f = 0; f < weights.size(); ++f) {
    mean += float4(static_cast<float>(weights[f]) / 64.0F) * s.features.features[f];
  }
  Float4 along = mean - float4(dot3(mean, s.normal)) * s.normal;
  const float length = std::sqrt(dot3(along, along));
  if (length > 0.0F) along /= float4(length);
  const Float4 error = s.target - mean;
  const int size = SpreadContexts::size_class(s.mean_square);
  const Float4 across = rotate_axes(cross_rotated(s.normal, along));
  return {{std::fabs(dot3(error, along)), std::fabs(dot3(error, across)), std::fabs(dot3(error, s.normal))},
          {SpreadContexts::kAlong + size, SpreadContexts::kAcross + size,
           SpreadContexts::normal(s.bend_square, s.mean_square)},
          length > 0.0F ? std::size_t{0} : std::size_t{2}};
}

void GeometryTraining::learn_shifts(FreeParentStatistics& statistics) const {
  if (static_cast<double>(shifts_.size()) < kLeastSamples) return;
  LeastSquares squares;
  for (const Shift& s : shifts_) {
    squares.add(s.sample.features, s.shift, 1.0 / (static_cast<double>(s.sample.mean_square) + 1e-6));
  }
  const auto solution = squares.solve(statistics.weights);
  for (std::size_t f = 0; f < kFeatures; ++f) {
    statistics.weights[f] = static_cast<std::int8_t>(std::clamp(std::lround(64.0 * solution[f]), -127L, 127L));
  }
  std::array<double, 3> sums{};
  for (const Shift& s : shifts_) {
    Float4 error = s.shift;
    for (std::size_t f = 0; f < kFeatures; ++f) {
      error -= float4(static_cast<float>(statistics.weights[f]) / 64.0F) * s.sample.features.features[f];
    }
    const Float4 displacement = s.sample.target;
    Float4 along = displacement - float4(dot3(displacement, s.sample.normal)) * s.sample.normal;
    const float length = std::sqrt(dot3(displacement, displacement)) + 1.0F;
    const float flat = std::sqrt(dot3(along, along));
    if (flat > 0.0F) along /= float4(flat);
    const Float4 across = rotate_axes(cross_rotated(s.sample.normal, along));
    sums[0] += std::fabs(dot3(error, along)) / length;
    sums[1] += std::fabs(dot3(error, across)) / length;
    sums[2] += std::fabs(dot3(error, s.sample.normal)) / (std::sqrt(s.sample.bend_square) + 1.0F);
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double spread = std::max(1.3085 * sums[i] / static_cast<double>(shifts_.size()), 1e-3);
    statistics.spreads[i] = static_cast<std::int8_t>(std::clamp(std::lround(8.0 * std::log2(spread)), -64L, 120L));
  }
}

void GeometryTraining::learn_weights(SplitStatistics& statistics, bool at_a_price) const {
  std::vector<std::vector<const Sample*>> classes(SplitStatistics::kClasses);
  for (const Sample& s : samples_) classes[s.prediction()].push_back(&s);
  for (std::size_t c = 0; c < classes.size(); ++c) {
    if (static_cast<double>(classes[c].size()) < 2.0 * kLeastSamples) continue;
    const Weights before = statistics.weights[c];
    LeastSquares squares;
    for (const Sample* s : classes[c]) {
      squares.add(s->features, s->target, 1.0 / (static_cast<double>(s->mean_square) + 1e-6));
    }
    const auto solution = squares.solve(before);
    Weights after;
    double price = kGroupBits;
    for (std::size_t f = 0; f < after.size(); ++f) {
      after[f] = static_cast<std::int8_t>(std::clamp(std::lround(64.0 * solution[f]), -127L, 127L));
      price += number_bits(after[f] - before[f]);
    }
    const auto bits = [&](const Sample& s, const Weights& weights) {
      const Off o = off(s, weights);
      double sum = 0.0;
      for (std::size_t i = o.first; i < 3; ++i) {
        const int eighths = statistics.spreads[static_cast<std::size_t>(o.spreads[i])] + statistics.scales[c];
        sum += distance_bits(o.amounts[i] / spread_of(eighths));
      }
      return sum;
    };
    double saved = 0.0;
    for (const Sample* s : classes[c]) saved += bits(*s, before) - bits(*s, after);
    if (static_cast<double>(stride_) * saved > (at_a_price ? price : 0.0)) statistics.weights[c] = after;
  }
}

// Calls f(spread, class, amount) for each axis of each sample: how far it is off, in what its spread is said to be.
template <class F>
void GeometryTraining::for_each_offset(const SplitStatistics& statistics, const F& f) const {
  for (const Sample& s : samples_) {
    const std::size_t c = s.prediction();
    const Off o = off(s, statistics.weights[c]);
    for (std::size_t i = o.first; i < 3; ++i) {
      const auto spread = static_cast<std::size_t>(o.spreads[i]);
      f(spread, c, o.amounts[i] / spread_of(statistics.spreads[spread] + statistics.scales[c]));
    }
  }
}

void GeometryTraining::learn_spreads(SplitStatistics& statistics, bool at_a_price) const {
  std::vector<SpreadFit> fits(SpreadContexts::kSpreads);
  for_each_offset(statistics, [&](std::size_t spread, std::size_t, auto amount) { fits[spread].add(amount); });
  for (std::size_t i = 0; i < fits.size(); ++i) replace(statistics.spreads[i], fits[i], at_a_price, stride_);
}

void GeometryTraining::learn_scales(SplitStatistics& statistics, bool at_a_price) const {
  std::vector<SpreadFit> fits(SplitStatistics::kClasses);
  for_each_offset(statistics, [&](std::size_t, std::size_t c, auto amount) { fits[c].add(amount); });
  for (std::size_t c = 0; c < fits.size(); ++c) replace(statistics.scales[c], fits[c], at_a_price, stride_);
}

namespace {

// A table's shares, and what they and the data take.
class TableChoice {
 public:
  TableChoice(std::span<const double> counts, std::span<const std::uint8_t> built_in)
      : counts_(counts), built_in_(built_in), bits_(bits_of(built_in)) {
    std::copy(built_in.begin(), built_in.end(), shares_.begin());
  }
  void offer(std::span<const std::uint8_t> shares) {
    const double bits = bits_of(shares);
    if (bits >= bits_) return;
    bits_ = bits;
    std::copy(shares.begin(), shares.end(), shares_.begin());
  }
  std::span<const std::uint8_t> best() const { return std::span(shares_).first(counts_.size()); }

 private:
  double bits_of(std::span<const std::uint8_t> shares) const {
    const FrequencyTable table = table_of(shares);
    double bits = SplitStatistics::table_bits(shares, built_in_);
    for (std::size_t s = 0; s < counts_.size(); ++s) {
      if (counts_[s] > 0.0) bits += counts_[s] * table.cost_bits(static_cast<int>(s));
    }
    return bits;
  }

  std::span<const double> counts_;
  std::span<const std::uint8_t> built_in_;
  double bits_;
  std::array<std::uint8_t, FrequencyTable::kMaxSymbols> shares_{};
};

}  // namespace

void learn_symbols(const CountingCoder::Counts& counts, SplitStatistics& statistics) {
  for (std::size_t t = 0; t < counts.size(); ++t) {
    const auto size =
        static_cast<std::size_t>(SymbolContexts::table_symbol_count(static_cast<int>(t), statistics.has_free_parents));
    const std::span<std::uint8_t> current(statistics.symbols[t].data(), size);
    const std::span<const double> seen(counts[t].data(), size);
    const FrequencyTable before = table_of(current);
    std::array<double, FrequencyTable::kMaxSymbols> blended{};
    double sum = 0.0;
    for (std::size_t s = 0; s < size; ++s) {
      blended[s] = seen[s] + 4.0 * before.frequency(static_cast<int>(s)) / FrequencyTable::kTotal;
      sum += blended[s];
    }
    if (sum < kLeastSamples) continue;
    std::array<std::uint8_t, FrequencyTable::kMaxSymbols> shares{};
    TableChoice choice(seen, current);
    // Its own shares up to some symbol; then one after the other as built in, or half the way there.
    std::copy(current.begin(), current.end(), shares.begin());
    for (std::size_t s = 0; s < size; ++s) {
      shares[s] = coded_share(blended[s], sum);
      choice.offer(std::span(shares).first(size));
    }
    for (std::size_t s = 0; s < size; ++s) {
      std::copy(choice.best().begin(), choice.best().end(), shares.begin());
      if (shares[s] == current[s]) continue;
      const std::uint8_t own = shares[s];
      for (const int nearer : {int{current[s]}, (int{own} + int{current[s]}) / 2}) {
        shares[s] = static_cast<std::uint8_t>(nearer);
        choice.offer(std::span(shares).first(size));
      }
    }
    std::copy(choice.best().begin(), choice.best().end(), shares.begin());
    std::copy_n(shares.begin(), size, current.begin());
  }
}

}  // namespace fanstream
