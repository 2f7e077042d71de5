#include "server/net/connection.h"

#include <linux/sockios.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>

#include <array>
#include <chrono>

namespace fanstream {
namespace {

constexpr std::size_t kReadBytes = 16 * 1024;
constexpr int kReadsPerTurn = 4;  // then other connections of this thread get theirs
constexpr int kWritesPerTurn = 8;
constexpr TimeMs kLingerMs = 1'000;  // for the client to read our last words before a reset could overtake them

TimeMs now_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

bool would_block(const asio::error_code& error) {
  return error == asio::error::would_block || error == asio::error::try_again || error == asio::error::interrupted;
}

}  // namespace

Connection::Connection(asio::ip::tcp::socket socket, ServerShared& shared, std::function<void(Connection*)> on_end)
    : socket_(std::move(socket)),
      timer_(socket_.get_executor()),
      shared_(shared),
      on_end_(std::move(on_end)),
      session_(shared.options.session, now_ms()) {}

void Connection::start(bool refuse_as_full) {
  asio::dispatch(socket_.get_executor(), [self = shared_from_this(), refuse_as_full] {
    self->configure_socket();
    if (refuse_as_full) {
      self->told_to_stop_ = true;  // counted as refused, not as failed
      self->session_.close(ErrorCode::server_full, "the server has as many clients as it takes; try again later");
    }
    self->arm_timer();
    self->pump();
  });
}

void Connection::shut_down() {
  asio::post(socket_.get_executor(), [self = shared_from_this()] {
    self->told_to_stop_ = true;
    self->session_.close(ErrorCode::shutting_down, "the server is shutting down");
    self->pump();
  });
}

// A failure here shows itself in the first read.
void Connection::configure_socket() {
  asio::error_code ignored;
  socket_.non_blocking(true, ignored);
  socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
  using NotSentLowWater = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>;
  socket_.set_option(NotSentLowWater(shared_.options.unsent_low_water_bytes), ignored);
}

void Connection::pump() {
  if (ended_ || lingering_) return;
  while (const std::optional<ServerEvent> event = session_.next_event(now_ms())) answer(*event);
  if (session_.finished()) return linger();
  wait_readable();
  wait_writable();
}

void Connection::answer(const ServerEvent& event) {
  if (std::holds_alternative<ListRequested>(event)) {
    session_.send_catalogue(shared_.models->catalogue());
  } else {
    answer_open(std::get<OpenRequested>(event).model);
    arm_timer();
  }
}

void Connection::answer_open(const std::string& model) {
  const ModelStatus status = shared_.models->open(model);
  switch (status.state) {
    case ModelStatus::State::unknown:
      return session_.open_failed(ErrorCode::unknown_model, "this server has no such model; 'list' names those it has");
    case ModelStatus::State::failed: return session_.open_failed(ErrorCode::model_failed, status.reason);
    case ModelStatus::State::building: return session_.open_building(status.fraction, now_ms());
    case ModelStatus::State::ready: return session_.open_ready(status.source);
  }
}

void Connection::wait_readable() {
  if (reading_ || !session_.wants_to_receive()) return;
  reading_ = true;
  socket_.async_wait(asio::socket_base::wait_read, [self = shared_from_this()](const asio::error_code& error) {
    self->reading_ = false;
    if (self->ended_ || self->lingering_) return;
    if (error) return self->end();
    self->read_some();
  });
}

void Connection::read_some() {
  if (take_input()) pump();
}

// Reads and handles what is there. False if the connection has ended.
bool Connection::take_input() {
  for (int i = 0; i < kReadsPerTurn && session_.wants_to_receive(); ++i) {
    const std::span<std::byte> room = session_.prepare(kReadBytes);
    asio::error_code error;
    const std::size_t size = socket_.read_some(asio::buffer(room.data(), room.size()), error);
    session_.commit(size, now_ms());
    if (would_block(error)) break;
    if (error)
      return end(), false;  // also when the client closed only its half: it can neither want nor grant any more
    while (const std::optional<ServerEvent> event = session_.next_event(now_ms())) answer(*event);
    if (size < room.size()) break;
  }
  return true;
}

void Connection::wait_writable() {
  if (writing_ || !session_.wants_to_send()) return;
  writing_ = true;
  socket_.async_wait(asio::socket_base::wait_write, [self = shared_from_this()](const asio::error_code& error) {
    self->writing_ = false;
    if (self->ended_ || self->lingering_) return;
    if (error) return self->end();
    self->write_some();
  });
}

// The kernel says 'writable' below half of the low water mark. Within a turn this is asked again: whatever it holds
// unsent when a new list of wants comes is sent all the same.
bool Connection::holds_little_unsent() {
  int unsent_bytes = 0;
  if (::ioctl(socket_.native_handle(), SIOCOUTQNSD, &unsent_bytes) != 0) return false;
  return unsent_bytes < shared_.options.unsent_low_water_bytes / 2;
}

// The socket can take bytes: only now is it decided which, by the newest list that has come.
void Connection::write_some() {
  if (!take_input()) return;
  std::array<Bytes, 64> buffers;                // as many as Asio passes on in one write
  thread_local std::vector<std::byte> scratch;  // needed only until the bytes are in the socket
  for (int i = 0; i < kWritesPerTurn && session_.wants_to_send(); ++i) {
    if (i > 0 && !holds_little_unsent()) break;
    const std::size_t count = session_.next_write(buffers, scratch);
    if (count == 0) break;
    gather_.clear();
    std::size_t total_bytes = 0;
    for (const Bytes& buffer : std::span(buffers).first(count)) {
      gather_.emplace_back(buffer.data(), buffer.size());
      total_bytes += buffer.size();
    }
    asio::error_code error;
    const std::size_t size = socket_.write_some(gather_, error);
    const std::uint64_t segments_before = session_.sent_segments();
    session_.written(size, now_ms());
    shared_.counters.sent_bytes += size;
    shared_.counters.sent_segments += session_.sent_segments() - segments_before;
    if (error && !would_block(error)) return end();
    if (size < total_bytes) break;
  }
  pump();
}

void Connection::arm_timer() {
  const TimeMs delay_ms = lingering_ ? kLingerMs : session_.pending_open() ? shared_.options.building_poll_ms : 1'000;
  timer_.expires_after(std::chrono::milliseconds(delay_ms));
  timer_.async_wait([self = shared_from_this()](const asio::error_code& error) {
    if (!error && !self->ended_) self->on_timer();
  });
}

void Connection::on_timer() {
  if (lingering_) {
    if (now_ms() >= linger_until_ms_) return end();
  } else {
    session_.tick(now_ms());
    if (const std::optional<std::string> model = session_.pending_open()) answer_open(*model);
  }
  arm_timer();
  pump();
}

void Connection::linger() {
  asio::error_code ignored;
  socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
  lingering_ = true;
  linger_until_ms_ = now_ms() + kLingerMs;
  arm_timer();
  discard_input();
}

// Closing with unread input makes the kernel send a reset, which can destroy the error message on its way to the
// client.
void Connection::discard_input() {
  socket_.async_wait(asio::socket_base::wait_read, [self = shared_from_this()](const asio::error_code& error) {
    if (self->ended_) return;
    if (error) return self->end();
    std::array<std::byte, kReadBytes> sink;
    asio::error_code read_error;
    self->socket_.read_some(asio::buffer(sink), read_error);
    if (read_error && !would_block(read_error)) return self->end();
    if (now_ms() >= self->linger_until_ms_) return self->end();
    self->discard_input();
  });
}

void Connection::end() {
  if (ended_) return;
  ended_ = true;
  if (session_.closing() && !told_to_stop_) ++shared_.counters.sessions_failed;
  asio::error_code ignored;
  timer_.cancel();
  socket_.close(ignored);
  on_end_(this);
}

}  // namespace fanstream
