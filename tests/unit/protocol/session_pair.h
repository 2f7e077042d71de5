// Both session machines joined by two byte queues, with a clock that only the test moves.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <variant>
#include <vector>

#include "protocol/client_session.h"
#include "protocol/server_session.h"
#include "tests/support/synthetic_source.h"

namespace fanstream {

struct SessionPair {
  explicit SessionPair(ServerSessionOptions server_options = {}, ClientSessionOptions client_options = {})
      : server(server_options, 0), client(client_options, 0) {}

  // Moves at most this many bytes of what the server has to say; returns how many it took.
  std::size_t server_to_client(std::size_t max_bytes = 1U << 30) {
    std::size_t moved = 0;
    while (server.wants_to_send() && moved < max_bytes) {
      std::array<Bytes, 64> buffers;
      const std::size_t count = server.next_write(buffers, scratch);
      if (count == 0) {
        serve();
        continue;
      }
      std::size_t taken = 0;
      for (const Bytes& buffer : std::span(buffers).first(count)) {
        const Bytes part = buffer.first(std::min(buffer.size(), max_bytes - moved - taken));
        client.receive(part, now_ms);
        taken += part.size();
      }
      server.written(taken, now_ms);
      moved += taken;
      serve();
    }
    return moved;
  }

  bool client_to_server() {
    bool moved = false;
    for (Bytes output = client.pending_output(); !output.empty(); output = client.pending_output()) {
      server.receive(output, now_ms);
      client.written(output.size());
      moved = true;
      serve();
    }
    return moved;
  }

  void serve() {
    while (const std::optional<ServerEvent> event = server.next_event(now_ms)) on_server_event(*event);
  }

  // Keeps events, segments as (cell, segment, bytes ok).
  bool take_events() {
    bool any = false;
    while (std::optional<ClientEvent> event = client.next_event()) {
      any = true;
      tell_table();
      if (const auto* arrived = std::get_if<event::SegmentArrived>(&*event)) {
        if (on_segment) on_segment(*arrived);
        arrived_cells.push_back({arrived->cell, arrived->segment});
      } else {
        events.push_back(std::move(*event));
      }
    }
    return any;
  }

  // What the client's user does as soon as it has the index.
  void tell_table() {
    if (table_told || !table || !client.model() || !client.index_complete()) return;
    table_told = true;
    const Result<void> set = client.set_segment_table(table);
    if (!set) throw std::runtime_error(set.error().message);
  }

  // Until nothing moves any more.
  void run() {
    for (bool moved = true; moved;) {
      moved = client_to_server();
      moved = server_to_client() > 0 || moved;
      moved = take_events() || moved;
    }
  }

  void open(const std::shared_ptr<const SegmentSource>& source, std::optional<Have> have = {}) {
    table = segment_table(*source);
    on_server_event = [this, source](const ServerEvent& event) {
      if (std::holds_alternative<OpenRequested>(event)) server.open_ready(source);
    };
    run();
    const Result<void> sent = client.open("model", std::move(have));
    if (!sent) throw std::runtime_error(sent.error().message);
  }

  template <class Event>
  const Event* last() const {
    for (auto event = events.rbegin(); event != events.rend(); ++event) {
      if (const Event* found = std::get_if<Event>(&*event)) return found;
    }
    return nullptr;
  }

  TimeMs now_ms = 0;
  std::vector<std::byte> scratch;
  ServerSession server;
  ClientSession client;
  std::shared_ptr<const SegmentTable> table;
  bool table_told = false;
  std::function<void(const ServerEvent&)> on_server_event = [](const ServerEvent&) {};
  std::function<void(const event::SegmentArrived&)> on_segment;
  std::vector<ClientEvent> events;
  std::vector<CellPrefix> arrived_cells;  // cell, segment
};

}  // namespace fanstream
