#include "client/net/stream_client.h"

#include <algorithm>
#include <deque>

#include "client/net/session_socket.h"

namespace fanstream {

namespace {

constexpr TimeMs kSliceMs = 100;  // how long a wait goes on before the stop flag is looked at

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
      : options(chosen), link(server, chosen.session), session(link.session()) {}

  Error located(Error error) const { return link.located(std::move(error)); }
  bool stop_requested() const { return options.stop != nullptr && options.stop->load(std::memory_order_relaxed); }
  Error stopped() const { return located({ErrorKind::interrupted, "stopped by the user"}); }

  Result<void> connect();
  Result<std::optional<ClientEvent>> poll(TimeMs deadline_ms);
  template <class Wanted>
  Result<Wanted> await(const std::function<void(double)>& on_building = {});

  StreamClientOptions options;
  SessionSocket link;
  ClientSession& session;
  std::deque<KeptEvent> kept;
  KeptEvent current;  // keeps the bytes of the event last given out
};

Result<void> StreamClient::Impl::connect() {
  const TimeMs deadline_ms = steady_now_ms() + options.connect_timeout_ms;
  if (Result<void> begun = link.begin_connect(deadline_ms); !begun) return begun;
  for (;;) {
    const Result<bool> connected = link.connected();
    if (!connected) return tl::unexpected<Error>(connected.error());
    if (*connected) break;
    if (stop_requested()) return tl::unexpected<Error>(stopped());
    if (steady_now_ms() >= deadline_ms) {
      return tl::unexpected<Error>(
          located({ErrorKind::network, "no connection within " + std::to_string(options.connect_timeout_ms) +
                                           " ms; is the host up and not behind a firewall?"}));
    }
    link.wait(std::clamp<TimeMs>(deadline_ms - steady_now_ms(), 1, kSliceMs));
  }
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

Result<std::optional<ClientEvent>> StreamClient::Impl::poll(TimeMs deadline_ms) {
  for (;;) {
    if (std::optional<ClientEvent> event = session.next_event()) {
      if (auto* failed = std::get_if<event::Failed>(&*event)) {
        link.close();
        return tl::unexpected<Error>(located(failed->error));
      }
      return event;
    }
    if (stop_requested()) return tl::unexpected<Error>(stopped());
    if (!link.ended() && link.move_bytes()) continue;
    session.tick(steady_now_ms());
    if (session.failed()) {
      if (link.ended()) return tl::unexpected<Error>(located({ErrorKind::network, "the connection is over"}));
      continue;
    }
    const TimeMs left_ms = deadline_ms - steady_now_ms();
    if (left_ms <= 0) return std::optional<ClientEvent>();
    link.wait(std::min(left_ms, kSliceMs));
  }
}

// Waits for one kind of event without an end of its own: the session's stall timeout is the end. Others are kept for
// next_event().
template <class Wanted>
Result<Wanted> StreamClient::Impl::await(const std::function<void(double)>& on_building) {
  for (;;) {
    Result<std::optional<ClientEvent>> event = poll(steady_now_ms() + kSliceMs);
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
  const TimeMs deadline_ms = steady_now_ms() + timeout_ms;
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
std::string StreamClient::server_text() const { return impl_->link.address().text(); }

}  // namespace fanstream
