// Bandwidth and round trip of a link, from what arrives and when: the most that lately came in a while, and the least
// time that answers took (after Cardwell et al., BBR: Congestion-Based Congestion Control, 2016).
//
// Answers that all take longer than they once did mean a link that has become longer, or only that what was asked for
// queues before them. So if the least of 15 s is longer, it is tried: more is asked for, and if that brings more
// bandwidth, the link has become longer; if not, it was the queue, and the shorter time holds until the next trial,
// which comes so late that trials take a twentieth of the time. No I/O and no clock: times are any monotonic
// milliseconds. Not thread safe.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "protocol/limits.h"

namespace fanstream {

class LinkEstimate {
 public:
  // An answer came now_ms that took so long.
  void round_trip(TimeMs ms, TimeMs now_ms) {
    if (round_trip_ms_ < 0 || ms <= before_trial_.value_or(round_trip_ms_)) {
      round_trip_ms_ = ms;
      before_trial_.reset();
      watched_ = 0;
      return;
    }
    if (before_trial_) {
      round_trip_ms_ = std::min(round_trip_ms_, ms);
      return;
    }
    if (watched_ == 0) watch_since_ms_ = now_ms;
    least_watched_ms_ = watched_ == 0 ? ms : std::min(least_watched_ms_, ms);
    ++watched_;
    if (watched_ < kLeastWatched || now_ms - watch_since_ms_ < watch_ms_) return;
    watched_ = 0;
    if (least_watched_ms_ > round_trip_ms_ + round_trip_ms_ / 4) try_round_trip(least_watched_ms_);
  }
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
    trial_took_ms_ += took_ms;
    const std::uint64_t best = bytes_per_s();
    if (best > grown_to_ + grown_to_ / 4) {
      grown_to_ = best;
      still_ = 0;
      if (before_trial_) watch_ms_ = kLeastWatchMs;
      before_trial_.reset();
    } else if (++still_ == kStillRounds && before_trial_) {
      round_trip_ms_ = *std::exchange(before_trial_, std::nullopt);
      watch_ms_ = std::max(kLeastWatchMs, kWatchesPerTrial * trial_took_ms_);
    }
    return true;
  }
  std::uint64_t bytes_per_s() const { return *std::max_element(rates_.begin(), rates_.end()); }
  std::uint64_t bandwidth_delay_bytes() const {
    return bytes_per_s() * static_cast<std::uint64_t>(std::max<TimeMs>(round_trip_ms_, 1)) / 1000;
  }
  // More credit still brought more bandwidth, or it is tried whether it does.
  bool growing() const { return still_ < kStillRounds; }
  TimeMs round_trip_ms() const { return round_trip_ms_; }  // below 0: unknown

 private:
  static constexpr TimeMs kLeastRoundMs = 50;
  static constexpr unsigned kStillRounds = 3;
  static constexpr TimeMs kLeastWatchMs = 15'000;
  static constexpr TimeMs kWatchesPerTrial = 20;
  static constexpr unsigned kLeastWatched = 3;

  void try_round_trip(TimeMs ms) {
    before_trial_ = round_trip_ms_;
    round_trip_ms_ = ms;
    grown_to_ = bytes_per_s();
    still_ = 0;
    trial_took_ms_ = 0;
  }

  TimeMs round_trip_ms_ = -1;  // unknown
  bool begun_ = false;
  TimeMs begun_ms_ = 0;
  std::uint64_t bytes_ = 0;
  std::array<std::uint64_t, 10> rates_{};  // of the last rounds
  std::size_t round_ = 0;
  std::uint64_t grown_to_ = 0;
  unsigned still_ = 0;    // rounds without growth
  unsigned watched_ = 0;  // answers since watch_since_ms_, all longer than round_trip_ms_
  TimeMs watch_since_ms_ = 0;
  TimeMs watch_ms_ = kLeastWatchMs;
  TimeMs least_watched_ms_ = 0;
  std::optional<TimeMs> before_trial_;  // the round trip that holds if the trial fails
  TimeMs trial_took_ms_ = 0;
};

}  // namespace fanstream
