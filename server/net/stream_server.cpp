#include "server/net/stream_server.h"

#include <asio.hpp>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <unordered_map>
#include <vector>

#include "server/net/connection.h"

namespace fanstream {

using asio::ip::tcp;

namespace {

constexpr std::uint32_t kRefusalsAtOnce = 64;  // connections kept only to say 'server full'

std::string address_text(const std::string& host, std::uint16_t port) {
  const bool v6 = host.find(':') != std::string::npos;
  std::string text = v6 ? "[" : "";
  return text.append(host).append(v6 ? "]:" : ":").append(std::to_string(port));
}

Error listen_error(const std::string& host, std::uint16_t port, const asio::error_code& error) {
  const std::string where = "cannot listen on " + address_text(host, port) + ": ";
  if (error == asio::error::address_in_use) {
    return {ErrorKind::network, where + "port " + std::to_string(port) +
                                    " is in use by another program; stop it or choose another port with --port"};
  }
  if (error == asio::error::access_denied) {
    return {ErrorKind::network, where + "not permitted; choose a port above 1023 with --port"};
  }
  return {ErrorKind::network, where + error.message()};
}

}  // namespace

struct StreamServer::Impl {
  Impl(const ServerOptions& options, std::shared_ptr<ModelProvider> models)
      : io(static_cast<int>(thread_count(options))), acceptor(asio::make_strand(io)), retry(acceptor.get_executor()) {
    shared.options = options;
    shared.models = std::move(models);
  }
  ~Impl() { stop(); }

  static unsigned thread_count(const ServerOptions& options) {
    return options.threads != 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());
  }

  Result<void> listen();
  void run();
  void accept();
  void add(tcp::socket socket);
  void remove(Connection* connection);
  void stop();

  ServerShared shared;  // before io: handlers that io still holds when it is destroyed refer to it
  std::mutex mutex;
  std::condition_variable all_gone;
  std::unordered_map<Connection*, std::weak_ptr<Connection>> connections;
  bool stopping = false;
  std::uint16_t port = 0;
  asio::io_context io;
  tcp::acceptor acceptor;
  asio::steady_timer retry;
  std::vector<std::thread> threads;
};

Result<void> StreamServer::Impl::listen() {
  const ServerOptions& options = shared.options;
  asio::error_code error;
  tcp::resolver resolver(io);
  const auto found = resolver.resolve(options.host, std::to_string(options.port),
                                      tcp::resolver::passive | tcp::resolver::numeric_service, error);
  if (error || found.empty()) {
    return fail(ErrorKind::network, "cannot listen on '" + options.host + "': " + error.message() +
                                        "; --host takes an address of this machine, 0.0.0.0 means all");
  }
  const tcp::endpoint endpoint = *found.begin();
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error && endpoint.protocol() == tcp::v6()) acceptor.set_option(asio::ip::v6_only(false), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) return tl::unexpected<Error>(listen_error(options.host, options.port, error));
  port = acceptor.local_endpoint(error).port();
  return {};
}

void StreamServer::Impl::run() {
  accept();
  for (unsigned i = 0; i < thread_count(shared.options); ++i) {
    threads.emplace_back([this] { io.run(); });
  }
}

void StreamServer::Impl::accept() {
  acceptor.async_accept(asio::make_strand(io), [this](const asio::error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted || !acceptor.is_open()) return;
    if (!error) {
      add(std::move(socket));
      return accept();
    }
    if (error == asio::error::connection_aborted) return accept();
    // No descriptors or memory left: the queue of the kernel holds the clients until some are free again.
    ++shared.counters.sessions_refused;
    retry.expires_after(std::chrono::milliseconds(100));
    retry.async_wait([this](const asio::error_code& cancelled) {
      if (!cancelled && acceptor.is_open()) accept();
    });
  });
}

void StreamServer::Impl::add(tcp::socket socket) {
  auto connection =
      std::make_shared<Connection>(std::move(socket), shared, [this](Connection* ended) { remove(ended); });
  bool full = false;
  {
    const std::lock_guard lock(mutex);
    full = connections.size() >= shared.options.max_sessions;
    if (full) ++shared.counters.sessions_refused;
    if (stopping || connections.size() >= shared.options.max_sessions + std::size_t{kRefusalsAtOnce}) return;
    connections.emplace(connection.get(), connection);
  }
  ++shared.counters.sessions_open;
  ++shared.counters.sessions_total;
  connection->start(full);
}

void StreamServer::Impl::remove(Connection* connection) {
  --shared.counters.sessions_open;
  const std::lock_guard lock(mutex);
  connections.erase(connection);
  if (connections.empty()) all_gone.notify_all();
}

void StreamServer::Impl::stop() {
  {
    std::unique_lock lock(mutex);
    if (stopping) return;
    stopping = true;
    asio::post(acceptor.get_executor(), [this] {
      asio::error_code ignored;
      acceptor.close(ignored);
      retry.cancel();
    });
    for (const auto& [unused, weak] : connections) {
      if (const std::shared_ptr<Connection> connection = weak.lock()) connection->shut_down();
    }
    all_gone.wait_for(lock, std::chrono::milliseconds(shared.options.drain_timeout_ms),
                      [&] { return connections.empty(); });
  }
  io.stop();
  for (std::thread& thread : threads) thread.join();
  threads.clear();
  asio::error_code ignored;
  acceptor.close(ignored);  // where io stopped before it came to that: clients are to be refused, not to wait
  shared.counters.sessions_open = 0;  // those that did not read the goodbye in time end with io
}

StreamServer::StreamServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StreamServer::~StreamServer() = default;

Result<std::unique_ptr<StreamServer>> StreamServer::start(const ServerOptions& options,
                                                          std::shared_ptr<ModelProvider> models) {
  auto impl = std::make_unique<Impl>(options, std::move(models));
  if (Result<void> listening = impl->listen(); !listening) return tl::unexpected<Error>(listening.error());
  impl->run();
  return std::unique_ptr<StreamServer>(new StreamServer(std::move(impl)));
}

std::uint16_t StreamServer::port() const { return impl_->port; }
void StreamServer::stop() { impl_->stop(); }

ServerMetrics StreamServer::metrics() const {
  const ServerCounters& counters = impl_->shared.counters;
  return {counters.sessions_open,   counters.sessions_total, counters.sessions_refused,
          counters.sessions_failed, counters.sent_bytes,     counters.sent_segments};
}

}  // namespace fanstream
