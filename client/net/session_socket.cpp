#include "client/net/session_socket.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace fanstream {

using asio::ip::tcp;

namespace {

constexpr std::size_t kReadBytes = 128 * 1024;

bool would_block(const asio::error_code& error) {
  return error == asio::error::would_block || error == asio::error::try_again || error == asio::error::interrupted;
}

}  // namespace

TimeMs steady_now_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

SessionSocket::SessionSocket(const ServerAddress& address, const ClientSessionOptions& options)
    : address_(address), socket_(io_), session_(options, steady_now_ms()) {}

Result<void> SessionSocket::begin_connect(TimeMs until_ms) {
  asio::error_code error;
  tcp::resolver resolver(io_);
  const auto found =
      resolver.resolve(address_.host, std::to_string(address_.port), tcp::resolver::numeric_service, error);
  if (error || found.empty()) {
    return tl::unexpected<Error>(located(
        {ErrorKind::network, "unknown host '" + address_.host + "': " + error.message() + "; check its spelling"}));
  }
  std::vector<tcp::endpoint> endpoints;
  for (const auto& entry : found) endpoints.push_back(entry.endpoint());
  begin_connect(std::move(endpoints), until_ms);
  return {};
}

void SessionSocket::begin_connect(std::vector<tcp::endpoint> endpoints, TimeMs until_ms) {
  endpoints_ = std::move(endpoints);
  endpoint_ = 0;
  until_ms_ = until_ms;
  try_endpoint();
}

// Each gets a share of the time that is left; the greeting after it counts for one more.
void SessionSocket::try_endpoint() {
  asio::error_code ignored;
  socket_.close(ignored);
  outcome_.reset();
  const TimeMs now_ms = steady_now_ms();
  const auto shares = static_cast<TimeMs>(endpoints_.size() - endpoint_ + 1);
  endpoint_until_ms_ = now_ms + std::max<TimeMs>(0, until_ms_ - now_ms) / shares;
  socket_.async_connect(endpoints_[endpoint_], [this, endpoint = endpoint_](const asio::error_code& error) {
    if (error != asio::error::operation_aborted && endpoint == endpoint_) outcome_ = error;
  });
}

Result<bool> SessionSocket::connected() {
  if (is_connected_) return true;
  const bool is_last = endpoint_ + 1 == endpoints_.size();
  if (!outcome_ && (is_last || steady_now_ms() < endpoint_until_ms_)) return false;
  if ((!outcome_ || *outcome_) && !is_last) {
    ++endpoint_;
    try_endpoint();
    return false;
  }
  if (*outcome_ == asio::error::connection_refused) {
    return tl::unexpected<Error>(
        located({ErrorKind::network, "connection refused; is the server running, and on this port?"}));
  }
  if (*outcome_) return tl::unexpected<Error>(located({ErrorKind::network, "cannot connect: " + outcome_->message()}));
  asio::error_code ignored;
  socket_.non_blocking(true, ignored);
  socket_.set_option(tcp::no_delay(true), ignored);
  is_connected_ = true;
  return true;
}

bool SessionSocket::move_bytes() {
  asio::error_code error;
  for (Bytes output = session_.pending_output(); !output.empty() && !write_broken_;
       output = session_.pending_output()) {
    session_.written(socket_.write_some(asio::buffer(output.data(), output.size()), error));
    if (would_block(error)) break;
    write_broken_ = static_cast<bool>(error);  // what the server still said is read first
  }
  if (read_ended_) return false;
  const std::span<std::byte> room = session_.prepare(kReadBytes);
  const std::size_t size = socket_.read_some(asio::buffer(room.data(), room.size()), error);
  session_.commit(size, steady_now_ms());
  if (size > 0) return true;
  if (would_block(error) && !write_broken_) return false;
  read_ended_ = true;
  session_.transport_closed(error == asio::error::eof ? "the server closed the connection"
                                                      : "the connection was lost (" + error.message() + ")");
  return true;
}

void SessionSocket::wait(TimeMs most_ms) {
  if (is_connected_ && !waiting_readable_) {
    waiting_readable_ = true;
    socket_.async_wait(tcp::socket::wait_read, [this](const asio::error_code&) { waiting_readable_ = false; });
  }
  if (is_connected_ && !waiting_writable_ && !session_.pending_output().empty()) {
    waiting_writable_ = true;
    socket_.async_wait(tcp::socket::wait_write, [this](const asio::error_code&) { waiting_writable_ = false; });
  }
  io_.restart();
  io_.run_one_for(std::chrono::milliseconds(most_ms));
}

void SessionSocket::close() {
  asio::error_code ignored;
  socket_.close(ignored);
  read_ended_ = write_broken_ = true;
}

}  // namespace fanstream
