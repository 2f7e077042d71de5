#include "common/coding/rans.h"

#include <algorithm>

namespace fanstream {

std::vector<std::byte> RansEncoder::finish() {
  std::vector<std::uint16_t> words;  // last first
  std::uint32_t state = RansDecoder::kStart;
  for (std::size_t i = steps_.size(); i-- > 0;) {
    const std::uint32_t frequency = steps_[i].frequency;
    // frequency << 17 may not fit in 32 bits only for a certain symbol, which never needs room.
    if (static_cast<std::uint64_t>(state) >= static_cast<std::uint64_t>(frequency) << 17U) {
      words.push_back(static_cast<std::uint16_t>(state));
      state >>= 16U;
    }
    state = ((state / frequency) << FrequencyTable::kBits) + state % frequency + steps_[i].start;
  }
  std::vector<std::byte> bytes;
  if (steps_.empty()) return bytes;
  bytes.reserve(words.size() * 2 + 4);
  const auto put = [&bytes](std::uint32_t word) {
    bytes.push_back(static_cast<std::byte>(word));
    bytes.push_back(static_cast<std::byte>(word >> 8U));
  };
  put(state);
  put(state >> 16U);
  for (std::size_t i = words.size(); i-- > 0;) put(words[i]);
  steps_.clear();
  return bytes;
}

RansDecoder::RansDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
  if (bytes.empty()) return;
  state_ = 0;
  refill();
  const std::uint32_t low = state_;
  state_ = 0;
  refill();
  state_ = state_ << 16U | low;
  if (state_ < kStart) overran_ = true;
}

}  // namespace fanstream
