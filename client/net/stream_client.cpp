#include "client/net/stream_client.h"

#include <algorithm>
#include <asio.hpp>
#include <chrono>
#include <deque>

namespace fanstream {

using asio::ip::tcp;

namespace {

constexpr std::size_t kReadBytes = 128 * 1024;
constexpr TimeMs kSliceMs = 100;  // how long a wait goes on before the stop flag is looked at

TimeMs now_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

bool would_block(const asio::error_code& error) {
  return error == asio::error::would_block || error == asio::error::try_again || error == asio::error::interrupted;
}

// An event that came while another was waited for; a segment's bytes are kept with it.
struct KeptEvent {
  ClientEvent event;
  std::vector<std::byte> bytes;
};

KeptEvent keep(ClientEvent event) {
  KeptEvent kept{std::move(event), {}};
  if (auto* segment = std::get_if<event::SegmentArrived>(&kept.event)) {
    kept.bytes.assign(segment->bytes.begin(), segment->bytes.end());
  }
  return kept;
}

}  // namespace

struct StreamClient::Impl {
  Impl(const ServerAddress& server, const StreamClientOptions& chosen)
      : address(server), options(chosen), socket(io), session(chosen.session, now_ms()) {}

  Error located(Error error) const { return with_context(std::move(error), address.text()); }
  bool stop_requested() const { return options.stop != nullptr && options.stop->load(std::memory_order_relaxed); }
  Error stopped() const { return located({ErrorKind::interrupted, "stopped by the user"}); }

  Result<void> connect();
  Result<void> connect_to(const tcp::endpoint& endpoint, TimeMs deadline_ms);
  Result<std::optional<ClientEvent>> poll(TimeMs deadline_ms);
  bool move_bytes();
  void wait(TimeMs slice_ms);
  template <class Wanted>
  Result<Wanted> await(const std::function<void(double)>& on_building = {});

  ServerAddress address;
  StreamClientOptions options;
  asio::io_context io;
  tcp::socket socket;
  ClientSession session;
  bool waiting_readable = false;
  bool waiting_writable = false;
  bool write_broken = false;
  bool read_ended = false;
  std::deque<KeptEvent> kept;
  KeptEvent current;  // keeps the bytes of the event last given out
};

Result<void> StreamClient::Impl::connect() {
  const TimeMs deadline_ms = now_ms() + options.connect_timeout_ms;
  asio::error_code error;
  tcp::resolver resolver(io);
  const auto endpoints =
      resolver.resolve(address.host, std::to_string(address.port), tcp::resolver::numeric_service, error);
  if (error) {
    return tl::unexpected<Error>(located(
        {ErrorKind::network, "unknown host '" + address.host + "': " + error.message() + "; check its spelling"}));
  }
  Result<void> connected = fail(ErrorKind::network, "the host has no address");
  for (const auto& entry : endpoints) {
    connected = connect_to(entry.endpoint(), deadline_ms);
    if (connected || connected.error().kind == ErrorKind::interrupted) break;
  }
  if (!connected) return connected;
  while (!session.welcomed()) {
    const Result<std::optional<ClientEvent>> event = poll(deadline_ms);
    if (!event) return tl::unexpected<Error>(event.error());
    if (!*event) {
      return tl::unexpected<Error>(located({ErrorKind::network, "connected, but no welcome came within " +
                                                                    std::to_string(options.connect_timeout_ms) +
                                                                    " ms; is this a Fanstream server?"}));
    }
  }
  return {};
}

Result<void> StreamClient::Impl::connect_to(const tcp::endpoint& endpoint, TimeMs deadline_ms) {
  asio::error_code ignored;
  socket.close(ignored);
  std::optional<asio::error_code> outcome;
  socket.async_connect(endpoint, [&](const asio::error_code& error) { outcome = error; });
  io.restart();
  bool timed_out = false;
  bool interrupted = false;
  while (!outcome) {
    io.run_one_for(std::chrono::milliseconds(std::clamp<TimeMs>(deadline_ms - now_ms(), 1, kSliceMs)));
    if (outcome || timed_out || interrupted) continue;
    interrupted = stop_requested();
    timed_out = now_ms() >= deadline_ms;
    if (timed_out || interrupted) socket.close(ignored);  // makes the handler come with operation_aborted
  }
  if (interrupted) return tl::unexpected<Error>(stopped());
  if (timed_out) {
    return tl::unexpected<Error>(
        located({ErrorKind::network, "no connection within " + std::to_string(options.connect_timeout_ms) +
                                         " ms; is the host up and not behind a firewall?"}));
  }
  if (*outcome == asio::error::connection_refused) {
    return tl::unexpected<Error>(
        located({ErrorKind::network, "connection refused; is the server running, and on this port?"}));
  }
  if (*outcome) return tl::unexpected<Error>(located({ErrorKind::network, "cannot connect: " + outcome->message()}));
  socket.non_blocking(true, ignored);
  socket.set_option(tcp::no_delay(true), ignored);
  return {};
}

// Writes and reads without waiting. True if bytes came or the transport ended: there may be events.
bool StreamClient::Impl::move_bytes() {
  asio::error_code error;
  for (Bytes output = session.pending_output(); !output.empty() && !write_broken; output = session.pending_output()) {
    session.written(socket.write_some(asio::buffer(output.data(), output.size()), error));
    if (would_block(error)) break;
    write_broken = static_cast<bool>(error);  // what the server still said is read first
  }
  if (read_ended) return false;
  const std::span<std::byte> room = session.prepare(kReadBytes);
  const std::size_t size = socket.read_some(asio::buffer(room.data(), room.size()), error);
  session.commit(size, now_ms());
  if (size > 0) return true;
  if (would_block(error) && !write_broken) return false;
  read_ended = true;
  session.transport_closed(error == asio::error::eof ? "the server closed the connection"
                                                     : "the connection was lost (" + error.message() + ")");
  return true;
}

void StreamClient::Impl::wait(TimeMs slice_ms) {
  if (!waiting_readable) {
    waiting_readable = true;
    socket.async_wait(tcp::socket::wait_read, [this](const asio::error_code&) { waiting_readable = false; });
  }
  if (!waiting_writable && !session.pending_output().empty()) {
    waiting_writable = true;
    socket.async_wait(tcp::socket::wait_write, [this](const asio::error_code&) { waiting_writable = false; });
  }
  io.restart();
  io.run_one_for(std::chrono::milliseconds(slice_ms));
}

Result<std::optional<ClientEvent>> StreamClient::Impl::poll(TimeMs deadline_ms) {
  for (;;) {
    if (std::optional<ClientEvent> event = session.next_event()) {
      if (auto* failed = std::get_if<event::Failed>(&*event)) {
        asio::error_code ignored;
        socket.close(ignored);
        read_ended = write_broken = true;
        return tl::unexpected<Error>(located(failed->error));
      }
      return event;
    }
    if (stop_requested()) return tl::unexpected<Error>(stopped());
    if (!read_ended && move_bytes()) continue;
    session.tick(now_ms());
    if (session.failed()) {
      if (read_ended) return fail(ErrorKind::network, address.text() + ": the connection is over");
      continue;
    }
    const TimeMs left_ms = deadline_ms - now_ms();
    if (left_ms <= 0) return std::optional<ClientEvent>();
    wait(std::min(left_ms, kSliceMs));
  }
}

// Waits for one kind of event without an end of its own: the session's stall timeout is the end. Others are kept for
// next_event().
template <class Wanted>
Result<Wanted> StreamClient::Impl::await(const std::function<void(double)>& on_building) {
  for (;;) {
    Result<std::optional<ClientEvent>> event = poll(now_ms() + kSliceMs);
    if (!event) return tl::unexpected<Error>(event.error());
    if (!*event) continue;
    if (auto* wanted = std::get_if<Wanted>(&**event)) return std::move(*wanted);
    if (const auto* building = std::get_if<event::BuildingModel>(&**event)) {
      if (on_building) on_building(building->fraction);
    } else if (const auto* refused = std::get_if<event::Refused>(&**event);
               refused != nullptr && std::is_same_v<Wanted, event::ModelOpened>) {
      return tl::unexpected<Error>(located({error_kind(refused->code), refused->text}));
    } else if (!std::holds_alternative<event::HeadComplete>(**event) &&
               !std::holds_alternative<event::IndexComplete>(**event)) {
      kept.push_back(keep(std::move(**event)));
    }
  }
}

StreamClient::StreamClient(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StreamClient::StreamClient(StreamClient&&) noexcept = default;
StreamClient& StreamClient::operator=(StreamClient&&) noexcept = default;
StreamClient::~StreamClient() = default;

Result<StreamClient> StreamClient::connect(const ServerAddress& address, const StreamClientOptions& options) {
  auto impl = std::make_unique<Impl>(address, options);
  if (Result<void> connected = impl->connect(); !connected) return tl::unexpected<Error>(connected.error());
  return StreamClient(std::move(impl));
}

Result<std::vector<CatalogueEntry>> StreamClient::list() {
  impl_->session.list();
  Result<event::Catalogue> catalogue = impl_->await<event::Catalogue>();
  if (!catalogue) return tl::unexpected<Error>(catalogue.error());
  return std::move(catalogue->entries);
}

Result<Opened> StreamClient::open(const std::string& model, const std::function<void(double)>& on_building,
                                  std::optional<Have> have) {
  if (Result<void> sent = impl_->session.open(model, std::move(have)); !sent) {
    return tl::unexpected<Error>(impl_->located(sent.error()));
  }
  const Result<event::ModelOpened> opened = impl_->await<event::ModelOpened>(on_building);
  if (!opened) return tl::unexpected<Error>(opened.error());
  return opened->model;
}

Result<Bytes> StreamClient::receive_head() {
  if (!impl_->session.model()) return fail(ErrorKind::usage, "no model is open");
  while (!impl_->session.head_complete()) {
    if (const auto waited = impl_->await<event::HeadComplete>(); !waited) return tl::unexpected<Error>(waited.error());
  }
  return impl_->session.head();
}

Result<Bytes> StreamClient::receive_index() {
  if (!impl_->session.model()) return fail(ErrorKind::usage, "no model is open");
  while (!impl_->session.index_complete()) {
    if (const auto waited = impl_->await<event::IndexComplete>(); !waited) return tl::unexpected<Error>(waited.error());
  }
  return impl_->session.index();
}

Result<std::uint32_t> StreamClient::set_wants(std::vector<CellRun> runs) {
  return impl_->session.set_wants(std::move(runs));
}
Result<void> StreamClient::set_segment_table(std::shared_ptr<const SegmentTable> table) {
  if (!impl_->session.index_complete()) return fail(ErrorKind::usage, "the index has not been received");
  Result<void> set = impl_->session.set_segment_table(std::move(table));
  if (!set) return tl::unexpected<Error>(impl_->located(set.error()));
  return set;
}
Result<void> StreamClient::release(const std::vector<CellRun>& runs) { return impl_->session.release(runs); }

Result<std::optional<ClientEvent>> StreamClient::next_event(TimeMs timeout_ms) {
  if (!impl_->kept.empty()) {
    impl_->current = std::move(impl_->kept.front());
    impl_->kept.pop_front();
    if (auto* segment = std::get_if<event::SegmentArrived>(&impl_->current.event))
      segment->bytes = impl_->current.bytes;
    return std::optional<ClientEvent>(impl_->current.event);
  }
  const TimeMs deadline_ms = now_ms() + timeout_ms;
  for (;;) {
    Result<std::optional<ClientEvent>> event = impl_->poll(deadline_ms);
    if (!event || !*event) return event;
    if (!std::holds_alternative<event::HeadComplete>(**event) &&
        !std::holds_alternative<event::IndexComplete>(**event)) {
      return event;
    }
  }
}

const ClientSession& StreamClient::session() const { return impl_->session; }
std::string StreamClient::server_text() const { return impl_->address.text(); }

}  // namespace fanstream
