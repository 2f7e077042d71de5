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

// The spread of a logistic distribution from its mean absolute value, as 8ths of a binary logarithm.
std::int8_t coded_spread(double mean_absolute) {
  const double spread = std::max(1.3085 * mean_absolute, 0.05);
  return static_cast<std::int8_t>(std::clamp(std::lround(8.0 * std::log2(spread)), -32L, 120L));
}

}  // namespace

void GeometryTraining::observe(const RingGeometry& ring, const FanSplit& split, const glm::vec3& unit) {
  if (seen_++ % stride_ != 0) return;
  const float sign = split.parent == ParentPosition::added ? -1.0F : 1.0F;
  samples_.push_back({ring_features(ring, split), float4(sign * glm::vec3(split.displacement) * unit), ring.normal(),
                      ring.mean_square(), ring.bend_square(), ring.is_open()});
  if (split.parent != ParentPosition::free) return;
  shifts_.push_back({samples_.back(), float4(glm::vec3(split.shift) * unit)});
}

void GeometryTraining::learn(SplitStatistics& statistics) const {
  learn_weights(statistics);
  learn_spreads(statistics);
  if (statistics.has_free_parents) learn_shifts(statistics.free_parent);
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

void GeometryTraining::learn_weights(SplitStatistics& statistics) const {
  std::vector<LeastSquares> classes(PredictionContexts::kClasses);
  for (const Sample& s : samples_) {
    const int index = PredictionContexts::index(s.features.middle, s.open, s.features.arc);
    const double size = static_cast<double>(s.mean_square) + 1e-6;
    classes[static_cast<std::size_t>(index)].add(s.features, s.target, 1.0 / size);
  }
  for (std::size_t c = 0; c < classes.size(); ++c) {
    if (classes[c].count < 4.0 * kLeastSamples) continue;
    const auto solution = classes[c].solve(statistics.weights[c]);
    for (std::size_t f = 0; f < kFeatures; ++f) {
      statistics.weights[c][f] = static_cast<std::int8_t>(std::clamp(std::lround(64.0 * solution[f]), -127L, 127L));
    }
  }
}

void GeometryTraining::learn_spreads(SplitStatistics& statistics) const {
  struct Mean {
    double sum = 0.0;
    double count = 0.0;
  };
  std::array<Mean, SpreadContexts::kSpreads> means{};
  Mean middle_ratio;
  for (const Sample& s : samples_) {
    Float4 mean{};
    const int context = PredictionContexts::index(s.features.middle, s.open, s.features.arc);
    const auto& weights = statistics.weights[static_cast<std::size_t>(context)];
    for (std::size_t f = 0; f < kFeatures; ++f) {
      mean += float4(static_cast<float>(weights[f]) / 64.0F) * s.features.features[f];
    }
    Float4 along = mean - float4(dot3(mean, s.normal)) * s.normal;
    const float length = std::sqrt(dot3(along, along));
    if (length > 0.0F) along /= float4(length);
    const Float4 error = s.target - mean;
    const int size = SpreadContexts::size_class(s.mean_square);
    const double tangential = std::fabs(dot3(error, along));
    if (s.features.middle) {
      const double expected =
          std::exp2(statistics.spreads[static_cast<std::size_t>(SpreadContexts::kAlong + size)] / 8.0);
      middle_ratio.sum += 1.3085 * tangential / expected;
      middle_ratio.count += 1.0;
      continue;
    }
    const auto add = [&](int index, double value) {
      means[static_cast<std::size_t>(index)].sum += value;
      means[static_cast<std::size_t>(index)].count += 1.0;
    };
    if (length > 0.0F) {
      add(SpreadContexts::kAlong + size, tangential);
      add(SpreadContexts::kAcross + size, std::fabs(dot3(error, rotate_axes(cross_rotated(s.normal, along)))));
    }
    add(SpreadContexts::normal(s.bend_square, s.mean_square), std::fabs(dot3(error, s.normal)));
  }
  for (std::size_t i = 0; i < means.size(); ++i) {
    if (means[i].count >= kLeastSamples) statistics.spreads[i] = coded_spread(means[i].sum / means[i].count);
  }
  if (middle_ratio.count >= kLeastSamples) {
    const double ratio = middle_ratio.sum / middle_ratio.count;
    statistics.spreads[SpreadContexts::kMiddleShift] =
        static_cast<std::int8_t>(std::clamp(std::lround(8.0 * std::log2(std::max(ratio, 0.01))), -32L, 32L));
  }
}

void learn_symbols(const CountingCoder::Counts& counts, SplitStatistics& statistics) {
  for (std::size_t t = 0; t < counts.size(); ++t) {
    const auto size =
        static_cast<std::size_t>(SymbolContexts::symbol_count(static_cast<int>(t), statistics.has_free_parents));
    const std::span<std::uint8_t> current(statistics.symbols[t].data(), size);
    const FrequencyTable before = table_of(current);
    std::array<double, FrequencyTable::kMaxSymbols> blended{};
    double sum = 0.0;
    for (std::size_t s = 0; s < size; ++s) {
      blended[s] = counts[t][s] + 4.0 * before.frequency(static_cast<int>(s)) / FrequencyTable::kTotal;
      sum += blended[s];
    }
    std::array<std::uint8_t, FrequencyTable::kMaxSymbols> shares{};
    for (std::size_t s = 0; s < size; ++s) shares[s] = coded_share(blended[s], sum);
    const FrequencyTable after = table_of(std::span<const std::uint8_t>(shares).first(size));
    double saved_bits = -2.0;
    for (std::size_t s = 0; s < size; ++s) {
      const auto symbol = static_cast<int>(s);
      saved_bits += counts[t][s] * (before.cost_bits(symbol) - after.cost_bits(symbol));
      saved_bits -= 2.2 + 0.6 * std::abs(static_cast<int>(shares[s]) - static_cast<int>(current[s]));
    }
    if (saved_bits > 0.0) std::copy_n(shares.begin(), size, current.begin());
  }
}

}  // namespace fanstream
