#include "common/coding/rans.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "tests/support/exact_bytes.h"
#include "tests/unit/common/coding/rans_message.h"

namespace fanstream {
namespace {

using testing::code;
using testing::ExactBytes;
using testing::Message;
using testing::random_message;
using testing::SeededRandom;
using testing::Step;

std::vector<std::byte> encoded(const Message& message) {
  RansEncoder encoder;
  for (const Step& step : message.steps) code(encoder, message, step);
  return encoder.finish();
}

// Decodes as many steps as the message has; true if that used up the bytes exactly.
bool passes(const Message& message, std::span<const std::byte> bytes) {
  RansDecoder decoder(bytes);
  for (const Step& step : message.steps) code(decoder, message, step);
  return decoder.finished_cleanly();
}

TEST(Rans, SymbolsAndBitsComeBack) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const Message message = random_message(random, random.below(600), 1 + random.below(9));
    const ExactBytes bytes(encoded(message));
    RansDecoder decoder(bytes.view());
    for (const Step& step : message.steps) ASSERT_EQ(code(decoder, message, step), step.value);
    EXPECT_TRUE(decoder.finished_cleanly());
    EXPECT_FALSE(decoder.starved());
  }
}

TEST(Rans, NothingTakesNoBytes) {
  RansEncoder encoder;
  EXPECT_TRUE(encoder.finish().empty());
  EXPECT_TRUE(RansDecoder(std::span<const std::byte>()).finished_cleanly());
  EXPECT_TRUE(RansDecoder().finished_cleanly());
}

TEST(Rans, AnEncoderIsEmptyAfterItHasFinished) {
  SeededRandom random(1);
  const Message message = random_message(random, 100, 4);
  RansEncoder encoder;
  for (const Step& step : message.steps) code(encoder, message, step);
  const auto bytes = encoder.finish();
  for (const Step& step : message.steps) code(encoder, message, step);
  EXPECT_EQ(encoder.finish(), bytes);
  EXPECT_TRUE(encoder.finish().empty());
}

double cost_bits(const Message& message) {
  double bits = 0.0;
  for (const Step& step : message.steps) {
    bits += step.table < 0
                ? step.bits
                : message.tables[static_cast<std::size_t>(step.table)].cost_bits(static_cast<int>(step.value));
  }
  return bits;
}

TEST(Rans, BytesAreAsManyAsTheSymbolsCost) {
  SeededRandom random(2);
  const Message message = random_message(random, 5000, 5);
  const double bits = cost_bits(message);
  const auto size_bits = 8.0 * static_cast<double>(encoded(message).size());
  EXPECT_LT(size_bits, bits * 1.002 + 16.0);
  EXPECT_GE(size_bits, bits - 16.0);  // the last symbols are coded in a state that is not full
}

// Half a word on average, and what the very last symbol costs more because its state has nothing to be spread over; a
// state that is full at the end costs half a word and a whole one.
TEST(Rans, AStreamCostsTwoBytesMoreThanItsSymbols) {
  double surplus = 0.0;
  constexpr int kStreams = 500;
  for (std::uint64_t seed = 0; seed < kStreams; ++seed) {
    SeededRandom random(seed);
    const Message message = random_message(random, 20 + random.below(80), 5);
    surplus += 8.0 * static_cast<double>(encoded(message).size()) - cost_bits(message);
  }
  std::printf("[  figures ] %.2f bits more than the symbols cost\n", surplus / kStreams);
  EXPECT_LT(surplus / kStreams, 19.0);
}

std::vector<int> numbers(const std::vector<std::byte>& bytes) {
  std::vector<int> result;
  for (const std::byte b : bytes) result.push_back(std::to_integer<int>(b));
  return result;
}

TEST(Rans, TheStateComesHighWordFirstInAsManyWordsAsItHas) {
  RansEncoder encoder;
  encoder.bits(15, 0);
  EXPECT_EQ(numbers(encoder.finish()), std::vector<int>{}) << "state 0";
  encoder.bits(15, 0x1234);
  EXPECT_EQ(numbers(encoder.finish()), (std::vector<int>{0x34, 0x12}));
  encoder.bits(15, 0x1234);
  encoder.bits(15, 0x5678);  // coded first: the state is 0x5678 << 15 | 0x1234
  EXPECT_EQ(numbers(encoder.finish()), (std::vector<int>{0x3C, 0x2B, 0x34, 0x12}));
  encoder.bits(15, 0x1234);
  encoder.bits(15, 0x5678);
  encoder.bits(15, 0x7ABC);  // 0x7ABC << 15 | 0x5678 has to lose a word before the first symbol
  EXPECT_EQ(numbers(encoder.finish()), (std::vector<int>{0xAF, 0x1E, 0x34, 0x12, 0x78, 0x56}));
}

// Without words the state runs down to 0, as it does at a stream's true end: how long a stream is, the format has to
// say. An odd number of bytes never passes.
TEST(Rans, OddNumbersOfBytesAreNoticed) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SeededRandom random(seed);
    const Message message = random_message(random, 20 + random.below(300), 4);
    auto bytes = encoded(message);
    bytes.push_back(std::byte{0});
    for (std::size_t size = 1; size <= bytes.size(); size += 2) {
      const ExactBytes odd{std::span(bytes).first(size)};
      ASSERT_FALSE(passes(message, odd.view())) << "seed " << seed << ", " << size << " bytes";
    }
  }
}

// A decoder takes surplus words as soon as its state has room, and ends in another one.
TEST(Rans, AlmostAllSurplusBytesAreNoticed) {
  std::size_t tried = 0;
  std::size_t missed = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SeededRandom random(seed);
    const Message message = random_message(random, 200, 4);
    for (std::size_t surplus = 1; surplus <= 4; ++surplus) {
      auto bytes = encoded(message);
      bytes.resize(bytes.size() + surplus);
      ++tried;
      missed += static_cast<std::size_t>(passes(message, bytes));
    }
  }
  std::printf("[  figures ] %zu of %zu surpluses went unnoticed\n", missed, tried);
  EXPECT_LT(static_cast<double>(missed), 0.02 * static_cast<double>(tried));
}

// Symbols of uneven frequencies pass damage on to all that follows. Raw bits do not (each is a value of its own), so a
// segment notices damage to them only by what its contexts make of the values.
TEST(Rans, AlmostEveryFlippedBitOfSymbolsIsNoticed) {
  std::size_t flipped = 0;
  std::size_t missed = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SeededRandom random(seed);
    const Message message = random_message(random, 600, 1U << 31U);
    ExactBytes bytes(encoded(message));
    for (std::size_t bit = 0; bit < bytes.view().size() * 8; ++bit) {
      bytes.flip(bit);
      ++flipped;
      missed += static_cast<std::size_t>(passes(message, bytes.view()));
      bytes.flip(bit);
    }
  }
  std::printf("[  figures ] %zu of %zu flipped bits went unnoticed\n", missed, flipped);
  EXPECT_GT(flipped, 50000U);
  EXPECT_LT(static_cast<double>(missed), 0.01 * static_cast<double>(flipped));
}

TEST(Rans, AnyBytesAreSafe) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const Message message = random_message(random, 200, 3);
    std::vector<std::byte> noise(random.below(120));
    for (std::byte& b : noise) b = static_cast<std::byte>(random.below(256));
    const ExactBytes bytes(noise);
    RansDecoder decoder(bytes.view());
    for (const Step& step : message.steps) {
      ASSERT_LT(code(decoder, message, step), value_count(message, step));
    }
  }
}

}  // namespace
}  // namespace fanstream
