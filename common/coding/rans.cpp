#include "common/coding/rans.h"

#include <algorithm>

namespace fanstream {

std::vector<std::vector<std::byte>> RansEncoder::finish_segments() {
  std::vector<std::vector<std::byte>> segments(cuts_.size() + 1);
  std::vector<std::uint16_t> words;  // of the current segment, last first
  std::uint32_t state = 0;
  std::size_t segment = cuts_.size();
  const auto close = [&] {
    std::vector<std::byte>& bytes = segments[segment];
    bytes.reserve(words.size() * 2);
    for (std::size_t i = words.size(); i-- > 0;) {
      bytes.push_back(static_cast<std::byte>(words[i]));
      bytes.push_back(static_cast<std::byte>(words[i] >> 8U));
    }
    words.clear();
  };
  for (std::size_t i = steps_.size(); i-- > 0;) {
    for (; segment > 0 && i < cuts_[segment - 1]; --segment) close();
    const Step& step = steps_[i];
    // What must be left free above: frequency << 17 may not fit in 32 bits only for a certain symbol, which never needs
    // room.
    const std::uint64_t most = step.raw_bits != 0 ? std::uint64_t{1} << (32U - step.raw_bits)
                                                  : static_cast<std::uint64_t>(step.frequency) << 17U;
    if (state >= most) {
      words.push_back(static_cast<std::uint16_t>(state));
      state >>= 16U;
    }
    if (step.raw_bits != 0) {
      state = state << step.raw_bits | step.start;
    } else {
      state = ((state / step.frequency) << FrequencyTable::kBits) + state % step.frequency + step.start;
    }
  }
  for (; state != 0; state >>= 16U) words.push_back(static_cast<std::uint16_t>(state));  // before the first symbol
  close();
  steps_.clear();
  cuts_.clear();
  return segments;
}

void RansDecoder::append(std::span<const std::byte> bytes, bool ends) {
  bytes_ = bytes.size() >= 2 ? bytes.data() : kNothing.data();
  position_ = 0;
  size_ = bytes.size();
  ends_ = ends;
  begun_ = begun_ || !bytes.empty();
  if (size_ % 2 != 0) {  // no encoder leaves that: nothing is read, nor is it ever used up
    position_ = 1;
    size_ = 0;
  }
  for (int words = 0; words < 2 && state_ < kLeast && position_ < size_; ++words) {
    state_ = state_ << 16U | std::to_integer<std::uint32_t>(bytes_[position_]) |
             std::to_integer<std::uint32_t>(bytes_[position_ + 1]) << 8U;
    position_ += 2;
  }
}

}  // namespace fanstream
