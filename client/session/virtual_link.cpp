#include "client/session/virtual_link.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fanstream {
namespace {

__extension__ using Wide = unsigned __int128;

constexpr std::uint64_t kBitsUs = 8'000'000;  // microseconds a byte takes at 1 bit/s

}  // namespace

VirtualPipe::VirtualPipe(const VirtualPipeOptions& options) : options_(options) {
  assert(options.rate_bit_s >= 1 && options.rate_bit_s <= 1'000'000'000'000);
  assert(options.delay_us >= 0 && options.delay_us <= 1'000'000'000);
}

TimeUs VirtualPipe::end_us(const Run& run, std::uint64_t bytes) const {
  const Wide us = (Wide{bytes} * kBitsUs + options_.rate_bit_s - 1) / options_.rate_bit_s;
  return run.start_us + static_cast<TimeUs>(std::min(us, Wide{1} << 62U));
}

// The most bytes whose end_us() is not after now.
std::uint64_t VirtualPipe::left_of(const Run& run, TimeUs now_us) const {
  if (now_us <= run.start_us) return 0;
  const Wide bytes = Wide{static_cast<std::uint64_t>(now_us - run.start_us)} * options_.rate_bit_s / kBitsUs;
  return static_cast<std::uint64_t>(std::min(bytes, Wide{run.size_bytes}));
}

void VirtualPipe::write(std::span<const std::byte> bytes, TimeUs now_us) {
  if (bytes.empty()) return;
  if (runs_.empty() || end_us(runs_.back(), runs_.back().size_bytes) < now_us) {
    runs_.push_back({now_us, written_bytes_, 0});
  }
  runs_.back().size_bytes += bytes.size();
  queue_.insert(queue_.end(), bytes.begin(), bytes.end());
  written_bytes_ += bytes.size();
}

std::uint64_t VirtualPipe::unsent_bytes(TimeUs now_us) const {
  if (runs_.empty()) return 0;
  return runs_.back().size_bytes - left_of(runs_.back(), now_us);  // earlier runs ended before this one began
}

std::size_t VirtualPipe::writable_bytes(TimeUs now_us) const {
  const std::uint64_t unsent = unsent_bytes(now_us);
  return unsent < options_.unsent_limit_bytes ? options_.unsent_limit_bytes - static_cast<std::size_t>(unsent) : 0;
}

std::size_t VirtualPipe::deliver(TimeUs now_us, std::vector<std::byte>& out) {
  std::uint64_t arrived = delivered_bytes_;
  for (const Run& run : runs_) {
    if (const std::uint64_t left = left_of(run, now_us - options_.delay_us); left > 0) {
      arrived = std::max(arrived, run.first_byte + left);
    }
  }
  const auto count = static_cast<std::size_t>(arrived - delivered_bytes_);
  const auto begin = queue_.begin() + static_cast<std::ptrdiff_t>(queue_begin_);
  out.insert(out.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
  delivered_bytes_ = arrived;
  queue_begin_ += count;
  if (queue_begin_ == queue_.size()) {
    queue_.clear();
    queue_begin_ = 0;
  } else if (queue_begin_ > queue_.size() / 2) {
    queue_.erase(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(queue_begin_));
    queue_begin_ = 0;
  }
  while (runs_.size() > 1 && runs_.front().first_byte + runs_.front().size_bytes <= delivered_bytes_) runs_.pop_front();
  return count;
}

TimeUs VirtualPipe::next_arrival_us() const {
  for (const Run& run : runs_) {
    if (run.first_byte + run.size_bytes <= delivered_bytes_) continue;
    return end_us(run, delivered_bytes_ - run.first_byte + 1) + options_.delay_us;
  }
  return kNever;
}

TimeUs VirtualPipe::last_arrival_us() const {
  return runs_.empty() ? 0 : end_us(runs_.back(), runs_.back().size_bytes) + options_.delay_us;
}

VirtualLinkOptions symmetric_link(double rate_mbit_s, double round_trip_ms) {
  VirtualLinkOptions link;
  const auto rate = static_cast<std::uint64_t>(std::llround(std::clamp(rate_mbit_s, 1e-6, 1e6) * 1e6));
  const auto round_trip_us = static_cast<TimeUs>(std::llround(std::clamp(round_trip_ms, 0.0, 1e6) * 1e3));
  link.to_client.rate_bit_s = link.to_server.rate_bit_s = rate;
  link.to_client.delay_us = round_trip_us / 2;
  link.to_server.delay_us = round_trip_us - round_trip_us / 2;
  return link;
}

double download_s(const VirtualLinkOptions& link, std::uint64_t size_bytes) {
  return 2e-6 * static_cast<double>(link.round_trip_us()) +
         8.0 * static_cast<double>(size_bytes) / static_cast<double>(link.to_client.rate_bit_s);
}

}  // namespace fanstream
