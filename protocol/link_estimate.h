// Bandwidth and round trip of a link, from what arrives and when: the most that lately came in a while, and the least
// time that any answer took (after Cardwell et al., BBR: Congestion-Based Congestion Control, 2016).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/limits.h"

namespace fanstream {

class LinkEstimate {
 public:
  void round_trip(TimeMs ms) { round_trip_ms_ = round_trip_ms_ < 0 ? ms : std::min(round_trip_ms_, ms); }
  // Nothing was asked for: what comes next says nothing of the time before.
  void pause() { begun_ = false; }
  // Bytes that came while more were asked for. True if the estimate is a new one.
  bool add(std::size_t size_bytes, TimeMs now_ms) {
    if (round_trip_ms_ < 0) return false;
    if (!begun_) {
      begun_ = true;
      begun_ms_ = now_ms;
      bytes_ = 0;
      return false;
    }
    bytes_ += size_bytes;
    const TimeMs took_ms = now_ms - begun_ms_;
    if (took_ms < std::max<TimeMs>(2 * round_trip_ms_, kLeastRoundMs)) return false;
    rates_[round_ % rates_.size()] = bytes_ * 1000 / static_cast<std::uint64_t>(took_ms);
    ++round_;
    begun_ms_ = now_ms;
    bytes_ = 0;
    const std::uint64_t best = bytes_per_s();
    if (best > grown_to_ + grown_to_ / 4) {
      grown_to_ = best;
      still_ = 0;
    } else {
      ++still_;
    }
    return true;
  }
  std::uint64_t bytes_per_s() const { return *std::max_element(rates_.begin(), rates_.end()); }
  std::uint64_t bandwidth_delay_bytes() const {
    return bytes_per_s() * static_cast<std::uint64_t>(std::max<TimeMs>(round_trip_ms_, 1)) / 1000;
  }
  // More credit still brought more bandwidth.
  bool growing() const { return still_ < kStillRounds; }

 private:
  static constexpr TimeMs kLeastRoundMs = 50;
  static constexpr unsigned kStillRounds = 3;
  TimeMs round_trip_ms_ = -1;  // unknown
  bool begun_ = false;
  TimeMs begun_ms_ = 0;
  std::uint64_t bytes_ = 0;
  std::array<std::uint64_t, 10> rates_{};  // of the last rounds
  std::size_t round_ = 0;
  std::uint64_t grown_to_ = 0;
  unsigned still_ = 0;
};

}  // namespace fanstream
