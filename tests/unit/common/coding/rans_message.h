// Random symbols and bits for the tests of range coding.
#pragma once

#include <cmath>
#include <vector>

#include "common/coding/rans.h"
#include "tests/support/seeded_random.h"

namespace fanstream::testing {

// What was coded: a symbol of a table, or raw bits.
struct Step {
  int table = -1;  // raw bits if negative
  int bits = 0;
  unsigned value = 0;
};

struct Message {
  std::vector<FrequencyTable> tables;
  std::vector<Step> steps;
};

// Tables from flat to all but certain, symbols drawn by their frequencies, one step in `raw_one_in` raw bits.
inline Message random_message(SeededRandom& random, std::size_t length, std::uint32_t raw_one_in) {
  Message message;
  for (int t = 0; t < 8; ++t) {
    std::vector<double> weights(1 + random.below(FrequencyTable::kMaxSymbols));
    const double steepness = 12.0 * random.unit();
    for (double& w : weights) w = std::exp(-steepness * random.unit());
    message.tables.push_back(FrequencyTable::from_weights(weights));
  }
  for (std::size_t i = 0; i < length; ++i) {
    if (random.one_in(raw_one_in)) {
      const int bits = static_cast<int>(random.below(16));
      message.steps.push_back({-1, bits, random.below(std::size_t{1} << bits)});
    } else {
      const int t = static_cast<int>(random.below(message.tables.size()));
      const int symbol = message.tables[static_cast<std::size_t>(t)].find(random.below(FrequencyTable::kTotal)).symbol;
      message.steps.push_back({t, 0, static_cast<unsigned>(symbol)});
    }
  }
  return message;
}

// How many values a step can have: from 0 up to one less.
inline unsigned value_count(const Message& message, const Step& step) {
  if (step.table < 0) return 1U << step.bits;
  return static_cast<unsigned>(message.tables[static_cast<std::size_t>(step.table)].symbol_count());
}

template <class Coder>
unsigned code(Coder& coder, const Message& message, const Step& step) {
  if (step.table < 0) return coder.bits(step.bits, step.value);
  return static_cast<unsigned>(
      coder.symbol(message.tables[static_cast<std::size_t>(step.table)], static_cast<int>(step.value)));
}

}  // namespace fanstream::testing
