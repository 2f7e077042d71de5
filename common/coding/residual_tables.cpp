#include "common/coding/residual_tables.h"

#include <array>
#include <cmath>

namespace fanstream {
namespace {

// exp(-x) for x >= 0 from multiplications alone, so that all machines agree to the last bit.
double decaying_exponential(double x) {
  if (x > 60.0) return 0.0;
  double power = 1.0 - x / 4096.0;
  for (int i = 0; i < 12; ++i) power *= power;
  return power;
}

// The logistic distribution function with standard deviation 1.
double logistic(double x) {
  constexpr double kScale = 1.81379936423421785;  // pi / sqrt(3)
  const double tail = 1.0 / (1.0 + 1.0 / (decaying_exponential(std::fabs(x) * kScale) + 1e-30));
  return x < 0.0 ? tail : 1.0 - tail;
}

// Symbols centre-15 .. centre+15 of width 1 around -mean, and the escape.
FrequencyTable make_table(double spread, double mean) {
  std::array<double, FrequencyTable::kMaxSymbols> weights{};
  double inside = 0.0;
  for (int i = 0; i < 31; ++i) {
    const double from = i - 15 - 0.5 - mean;
    const double share = logistic((from + 1.0) / spread) - logistic(from / spread);
    weights[static_cast<std::size_t>(i)] = share;
    inside += share;
  }
  // Real errors have longer tails than any one distribution fitted to their middle.
  weights[31] = 1.0 - inside + 0.0001;
  return FrequencyTable::from_weights(weights);
}

constexpr std::array<double, 4> kQuarterOctaves = {1.0, 1.18920711500272107, 1.41421356237309505, 1.68179283050742909};

}  // namespace

const ResidualTables& ResidualTables::instance() {
  static const ResidualTables tables;
  return tables;
}

ResidualTables::ResidualTables() {
  for (int step = 0; step < kSmall; ++step) {
    const double spread = std::ldexp(kQuarterOctaves[static_cast<std::size_t>(step % kSteps)], kLowest + step / kSteps);
    tables_[static_cast<std::size_t>(2 * step)] = make_table(spread, 0.125);
    tables_[static_cast<std::size_t>(2 * step + 1)] = make_table(spread, 0.375);
  }
  for (std::size_t step = 0; step < kSteps; ++step) {
    tables_[std::size_t{2} * kSmall + step] = make_table(2.0 * kQuarterOctaves[step], 0.0);
  }
}

}  // namespace fanstream
