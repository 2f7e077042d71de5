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
  // The symbol whose range holds `slot` < kTotal.
  int find(std::uint32_t slot) const {
    std::size_t found = first_of_block_[slot >> kBlockBits];
    while (start_[found + 1] <= slot) ++found;
    return static_cast<int>(found);
  }
  // Bits that coding `symbol` costs.
  double cost_bits(int symbol) const;

 private:
  void set_starts(std::span<const std::uint32_t> frequencies);

  static constexpr int kBlockBits = 8;

  std::array<std::uint16_t, kMaxSymbols + 1> start_{};
  std::array<std::uint8_t, (kTotal >> kBlockBits)> first_of_block_{};  // the symbol at each block's first slot
  int symbols_ = 0;
};

}  // namespace fanstream
