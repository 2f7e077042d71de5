#include "client/session/simulated_connection.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace fanstream {
namespace {

constexpr TimeUs kTickUs = 500'000;  // clocks are looked at so often when nothing else happens

// A step in which half of what a sender may queue leaves: a fast link must not run dry between two looks.
TimeUs step_for(const VirtualPipeOptions& pipe, TimeUs step_us) {
  const double half_us = 4e6 * static_cast<double>(pipe.unsent_limit_bytes) / static_cast<double>(pipe.rate_bit_s);
  return std::clamp(static_cast<TimeUs>(std::min(half_us, 1e9)), TimeUs{1}, std::max(step_us, TimeUs{1}));
}

}  // namespace

SimulatedConnection::SimulatedConnection(std::shared_ptr<const SegmentSource> source,
                                         const SimulatedConnectionOptions& options)
    : options_(options),
      source_(std::move(source)),
      to_client_(options.link.to_client),
      to_server_(options.link.to_server),
      server_(options.server, 0),
      client_(options.client, 0),
      connected_us_(options.link.round_trip_us()),
      busy_step_us_(step_for(options.link.to_client, options.step_us)) {
  assert(source_ != nullptr);
}

void SimulatedConnection::open(std::string model, std::optional<Have> have) {
  const Result<void> sent = client_.open(std::move(model), std::move(have));
  if (!sent) failure_ = sent.error();
}

Result<std::uint32_t> SimulatedConnection::set_wants(std::vector<CellRun> runs) {
  if (failure_) return tl::unexpected(*failure_);
  std::vector<std::uint32_t> prefixes(source_->cell_count(), 0);
  for (const CellRun& run : runs) {
    const std::uint64_t end = std::min<std::uint64_t>(std::uint64_t{run.first_cell} + run.cell_count, prefixes.size());
    for (std::uint64_t cell = run.first_cell; cell < end; ++cell) {
      prefixes[cell] = std::max(prefixes[cell], run.prefix);
    }
  }
  Result<std::uint32_t> epoch = client_.set_wants(std::move(runs));
  if (epoch) wanted_prefix_ = std::move(prefixes);
  return epoch;
}

Result<void> SimulatedConnection::release(const std::vector<CellRun>& runs) {
  if (failure_) return tl::unexpected(*failure_);
  return client_.release(runs);
}

Result<void> SimulatedConnection::run_until(TimeUs until_us, const OnEvent& on_event) {
  assert(until_us >= now_us_);
  if (!failure_) step(on_event);  // what was asked for since the last call leaves at once
  while (!failure_ && now_us_ < until_us) {
    now_us_ = next_time_us(until_us);
    step(on_event);
  }
  now_us_ = until_us;
  if (failure_) return tl::unexpected(*failure_);
  return {};
}

TimeUs SimulatedConnection::next_time_us(TimeUs until_us) const {
  TimeUs next_us = std::min(until_us, now_us_ + kTickUs);
  if (now_us_ < connected_us_) return std::min(next_us, connected_us_);
  const TimeUs soon_us = now_us_ + busy_step_us_;
  if (server_.wants_to_send()) next_us = std::min(next_us, soon_us);
  const TimeUs arrival_us = std::min(to_client_.next_arrival_us(), to_server_.next_arrival_us());
  return std::min(next_us, std::max(arrival_us, soon_us));
}

void SimulatedConnection::step(const OnEvent& on_event) {
  if (now_us_ >= connected_us_) {
    if (server_.wants_to_receive()) {
      arrived_.clear();
      to_server_.deliver(now_us_, arrived_);
      server_.receive(arrived_, now_ms());
    }
    serve();
    send_from_server();
    arrived_.clear();
    to_client_.deliver(now_us_, arrived_);
    client_.receive(arrived_, now_ms());
    if (server_.finished() && to_client_.delivered_bytes() == to_client_.written_bytes()) {
      client_.transport_closed("the server closed the connection");
    }
  }
  server_.tick(now_ms());
  client_.tick(now_ms());
  take_client_events(on_event);
  if (now_us_ < connected_us_) return;
  for (Bytes output = client_.pending_output(); !output.empty(); output = client_.pending_output()) {
    to_server_.write(output, now_us_);
    client_.written(output.size());
  }
}

void SimulatedConnection::serve() {
  while (const std::optional<ServerEvent> event = server_.next_event(now_ms())) {
    if (std::holds_alternative<OpenRequested>(*event)) {
      server_.open_ready(source_);
    } else {
      server_.send_catalogue({});
    }
  }
}

void SimulatedConnection::send_from_server() {
  std::array<Bytes, 64> buffers;
  for (std::size_t room = to_client_.writable_bytes(now_us_); room > 0 && server_.wants_to_send();
       room = to_client_.writable_bytes(now_us_)) {
    const std::size_t count = server_.next_write(buffers, scratch_);
    if (count == 0) return;
    std::size_t taken = 0;
    for (const Bytes& buffer : std::span(buffers).first(count)) {
      const Bytes part = buffer.first(std::min(buffer.size(), room - taken));
      to_client_.write(part, now_us_);
      taken += part.size();
    }
    server_.written(taken, now_ms());
  }
}

bool SimulatedConnection::is_wanted(std::uint32_t cell, std::uint32_t segment) const {
  return cell < wanted_prefix_.size() && segment < wanted_prefix_[cell];
}

void SimulatedConnection::take_client_events(const OnEvent& on_event) {
  while (const std::optional<ClientEvent> event = client_.next_event()) {
    if (const auto* segment = std::get_if<event::SegmentArrived>(&*event)) {
      if (!is_wanted(segment->cell, segment->segment)) stale_bytes_ += segment->bytes.size();
    } else if (const auto* failed = std::get_if<event::Failed>(&*event)) {
      failure_ = failed->error;
    }
    if (on_event) on_event(*event, now_us_);
    if (failure_) return;
  }
}

}  // namespace fanstream
