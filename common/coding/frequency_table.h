// Static symbol frequencies for range coding.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace fanstream {

// Up to 32 symbols whose frequencies add up to 2^15; every symbol has at least 2, so that anything can be coded.
class FrequencyTable {
 public:
  static constexpr int kBits = 15;
  static constexpr std::uint32_t kTotal = 1U << kBits;
  static constexpr int kMaxSymbols = 32;

  FrequencyTable() = default;            // of no use before it is assigned
  explicit FrequencyTable(int symbols);  // all alike

  // Frequencies in proportion to non-negative weights. The same weights give the same table on every machine.
  // Precondition: 1..32 weights.
  static FrequencyTable from_weights(std::span<const double> weights);

  int symbol_count() const { return symbols_; }
  std::uint16_t start(int symbol) const { return start_[static_cast<std::size_t>(symbol)]; }
  std::uint16_t frequency(int symbol) const {
    return static_cast<std::uint16_t>(start_[static_cast<std::size_t>(symbol) + 1] -
                                      start_[static_cast<std::size_t>(symbol)]);
  }
  // The symbol whose range holds `slot` < kTotal. Its start and frequency mostly come with what is looked up first,
  // since a decoder waits for them.
  struct Found {
    int symbol;
    std::uint32_t start;
    std::uint32_t frequency;
  };
  Found find(std::uint32_t slot) const {
    const std::uint32_t block = slot >> kBlockBits;
    const std::uint32_t range = first_range_[block];
    const std::uint32_t start = range & 0xFFFFU;
    const std::uint32_t frequency = range >> 16U;
    std::size_t symbol = first_symbol_[block];
    if (slot - start < frequency) [[likely]]
      return {static_cast<int>(symbol), start, frequency};
    do ++symbol;
    while (start_[symbol + 1] <= slot);
    return {static_cast<int>(symbol), start_[symbol], static_cast<std::uint32_t>(start_[symbol + 1]) - start_[symbol]};
  }
  // Bits that coding `symbol` costs.
  double cost_bits(int symbol) const;

 private:
  void set_starts(std::span<const std::uint32_t> frequencies);

  static constexpr int kBlockBits = 9;
  static constexpr std::size_t kBlocks = kTotal >> kBlockBits;

  // Of the symbol at each block's first slot: where it starts, with its frequency above; and which it is.
  alignas(64) std::array<std::uint32_t, kBlocks> first_range_{};
  std::array<std::uint8_t, kBlocks> first_symbol_{};
  std::array<std::uint16_t, kMaxSymbols + 1> start_{};
  int symbols_ = 0;
};

}  // namespace fanstream
