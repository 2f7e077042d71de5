#include "client/load/load_client.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <chrono>

#include "client/model/segment_order.h"

namespace fanstream {
namespace {

using std::chrono::steady_clock;
constexpr std::size_t kReadBytes = 64 * 1024;
constexpr int kReadsPerTurn = 8;

std::int64_t now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(steady_clock::now().time_since_epoch()).count();
}
TimeMs now_ms() { return now_us() / 1000; }

bool would_block(const asio::error_code& error) {
  return error == asio::error::would_block || error == asio::error::try_again || error == asio::error::interrupted;
}

Result<LoadTable> read_load_table(Bytes head, Bytes index) {
  const Result<AssetPreamble> preamble = read_preamble(head, "head");
  if (!preamble) return tl::unexpected<Error>(preamble.error());
  Result<AssetHead> asset_head = read_head(head, "head");
  if (!asset_head) return tl::unexpected<Error>(asset_head.error());
  Result<AssetIndex> asset_index = read_index(index, *preamble, *asset_head, "index");
  if (!asset_index) return tl::unexpected<Error>(asset_index.error());
  LoadTable table;
  table.segments = table.growing = segment_table(*asset_index);
  table.head = std::make_shared<const AssetHead>(std::move(*asset_head));
  table.index = std::make_shared<AssetIndex>(std::move(*asset_index));
  return table;
}

}  // namespace

Result<void> LoadTable::learn(std::uint32_t cell, std::uint32_t segment, Bytes bytes) const {
  if (!index || index->unknown_pages == 0 || !index->is_page(cell, segment)) return {};
  if (Result<void> read = read_page(bytes, cell, *head, *index, "index"); !read) return read;
  learn_children(*index, cell, *growing);
  return {};
}

Result<LoadTable> LoadTables::find(Bytes head, Bytes index) {
  const std::uint64_t key = XXH3_64bits_withSeed(index.data(), index.size(), XXH3_64bits(head.data(), head.size()));
  if (const auto found = tables_.find(key); found != tables_.end()) return found->second;
  Result<LoadTable> table = LoadTable{};
  if (options_.read_table) {
    const auto read = options_.read_table(head, index);
    if (!read) return tl::unexpected<Error>(read.error());
    table->segments = *read;
  } else {
    table = read_load_table(head, index);
  }
  if (table) tables_.emplace(key, *table);
  return table;
}

LoadClient::LoadClient(asio::io_context& io, const LoadOptions& options, LoadTables& tables,
                       std::atomic<std::uint64_t>& bytes_so_far, std::function<void()> on_connected, Done on_done)
    : socket_(io),
      timer_(io),
      options_(options),
      tables_(tables),
      bytes_so_far_(bytes_so_far),
      on_connected_(std::move(on_connected)),
      on_done_(std::move(on_done)),
      session_(options.session, now_ms()) {}

double LoadClient::elapsed_ms() const { return static_cast<double>(now_us() - started_us_) / 1000.0; }

void LoadClient::start(const asio::ip::tcp::endpoint& endpoint) {
  started_us_ = now_us();
  started_ms_ = now_ms();
  arm_timer();
  socket_.async_connect(endpoint, [self = shared_from_this()](const asio::error_code& error) {
    if (self->over_) return;
    if (error) return self->finish(Error{ErrorKind::network, "cannot connect: " + error.message()});
    asio::error_code ignored;
    self->socket_.non_blocking(true, ignored);
    self->socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
    self->pump();
  });
}

void LoadClient::arm_timer() {
  timer_.expires_after(std::chrono::milliseconds(500));
  timer_.async_wait([self = shared_from_this()](const asio::error_code& error) {
    if (error || self->over_) return;
    const TimeMs at_ms = now_ms();
    if (at_ms - self->started_ms_ > self->options_.timeout_ms) {
      const std::string_view awaiting = self->session_.awaiting();
      return self->finish(Error{ErrorKind::network, "not complete within " +
                                                        std::to_string(self->options_.timeout_ms / 1000) +
                                                        " s, while waiting for " + std::string(awaiting)});
    }
    self->session_.tick(at_ms);
    self->arm_timer();
    if (self->socket_.is_open() && self->session_.received_bytes() > 0) self->pump();
  });
}

void LoadClient::stop(Error why) {
  if (!over_) finish(std::move(why));
}

void LoadClient::pump() {
  for (;;) {
    while (!over_) {
      std::optional<ClientEvent> event = session_.next_event();
      if (!event) break;
      on_event(*event);
    }
    if (over_) return;
    asio::error_code error;
    for (Bytes output = session_.pending_output(); !output.empty(); output = session_.pending_output()) {
      session_.written(socket_.write_some(asio::buffer(output.data(), output.size()), error));
      if (error) break;  // a lost connection shows itself in the next read, after what the server still said
    }
    if (!session_.pending_output().empty()) wait_writable();
    if (!read_some()) break;
  }
  wait_readable();
}

// True if there may be events.
bool LoadClient::read_some() {
  if (reading_) return false;
  bool any = false;
  for (int i = 0; i < kReadsPerTurn; ++i) {
    const std::span<std::byte> room = session_.prepare(kReadBytes);
    asio::error_code error;
    const std::size_t size = socket_.read_some(asio::buffer(room.data(), room.size()), error);
    session_.commit(size, now_ms());
    bytes_so_far_ += size;
    if (size > 0) {
      any = true;
      continue;
    }
    if (!would_block(error)) {
      session_.transport_closed(error == asio::error::eof ? "the server closed the connection"
                                                          : "the connection was lost (" + error.message() + ")");
      return true;
    }
    break;
  }
  return any;
}

void LoadClient::wait_readable() {
  if (reading_ || over_) return;
  reading_ = true;
  socket_.async_wait(asio::socket_base::wait_read, [self = shared_from_this()](const asio::error_code&) {
    self->reading_ = false;
    if (!self->over_) self->pump();
  });
}

void LoadClient::wait_writable() {
  if (writing_ || over_) return;
  writing_ = true;
  socket_.async_wait(asio::socket_base::wait_write, [self = shared_from_this()](const asio::error_code&) {
    self->writing_ = false;
    if (!self->over_) self->pump();
  });
}

void LoadClient::hash_in(Bytes bytes, std::uint64_t seed) {
  outcome_.content_hash += XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

void LoadClient::on_event(ClientEvent& event) {
  if (auto* failed = std::get_if<event::Failed>(&event)) return finish(failed->error);
  if (const auto* refused = std::get_if<event::Refused>(&event)) {
    return finish(Error{error_kind(refused->code), refused->text});
  }
  if (std::holds_alternative<event::Welcomed>(event)) {
    outcome_.connected_ms = elapsed_ms();
    connected_or_over();
    if (const Result<void> sent = session_.open(options_.address.model); !sent) finish(sent.error());
  } else if (const auto* opened = std::get_if<event::ModelOpened>(&event)) {
    hash_in(std::as_bytes(std::span(opened->model.digest)), 1);
    const std::uint32_t cells = opened->model.cell_count;
    const std::vector<CellRun> all =
        cells == 0 ? std::vector<CellRun>{} : std::vector<CellRun>{{0, cells, kAllSegments}};
    if (const Result<std::uint32_t> sent = session_.set_wants(all); !sent) finish(sent.error());
  } else if (std::holds_alternative<event::HeadComplete>(event)) {
    outcome_.head_ms = elapsed_ms();
    hash_in(session_.head(), 2);
  } else if (std::holds_alternative<event::IndexComplete>(event)) {
    hash_in(session_.index(), 3);
    Result<LoadTable> table = tables_.find(session_.head(), session_.index());
    if (!table) return finish(table.error());
    table_ = std::move(*table);
    if (const Result<void> set = session_.set_segment_table(table_.segments); !set) finish(set.error());
  } else if (const auto* segment = std::get_if<event::SegmentArrived>(&event)) {
    hash_in(segment->bytes, (std::uint64_t{segment->cell} << 32 | segment->segment) + 4);
    if (const Result<void> learned = table_.learn(segment->cell, segment->segment, segment->bytes); !learned) {
      finish(learned.error());
    }
  } else if (std::holds_alternative<event::WantsServed>(event)) {
    // The session lets each segment through once and in order, so the count alone tells whether all came.
    const std::uint64_t expected = table_.segments ? table_.segments->nonempty_total() : 0;
    if (session_.received_segments() == expected && session_.index_complete()) return finish(std::nullopt);
    finish(Error{ErrorKind::bad_input, "the server says that all is sent, but " +
                                           std::to_string(session_.received_segments()) + " of " +
                                           std::to_string(expected) + " segments came"});
  }
}

void LoadClient::connected_or_over() {
  if (on_connected_) std::exchange(on_connected_, nullptr)();
}

void LoadClient::finish(std::optional<Error> error) {
  over_ = true;
  outcome_.complete_ms = elapsed_ms();
  outcome_.error = std::move(error);
  outcome_.bytes = session_.received_bytes();
  outcome_.segments = session_.received_segments();
  asio::error_code ignored;
  timer_.cancel();
  socket_.close(ignored);
  connected_or_over();
  std::exchange(on_done_, nullptr)(outcome_);
}

}  // namespace fanstream
