#include "client/load/load_run.h"

#include <algorithm>
#include <asio.hpp>
#include <chrono>
#include <cmath>
#include <mutex>
#include <set>
#include <thread>

#include "client/load/load_client.h"

namespace fanstream {

using asio::ip::tcp;

namespace {

// The clients of one thread.
class LoadThread {
 public:
  LoadThread(const LoadOptions& options, tcp::endpoint endpoint, std::uint32_t clients, std::uint32_t connecting,
             std::atomic<std::uint64_t>& bytes, std::atomic<std::uint32_t>& ended)
      : options_(options),
        endpoint_(std::move(endpoint)),
        total_(clients),
        left_(clients),
        slots_(connecting),
        bytes_(bytes),
        ended_(ended) {}

  void run() {
    start_some();
    watch_stop();
    io_.run();
  }
  const std::vector<LoadOutcome>& outcomes() const { return outcomes_; }

 private:
  void start_some() {
    while (slots_ > 0 && left_ > 0) {
      --slots_;
      --left_;
      auto client = std::make_shared<LoadClient>(
          io_, options_, tables_, bytes_,
          [this] {
            ++slots_;
            asio::post(io_, [this] { start_some(); });
          },
          [this](const LoadOutcome& outcome) {
            outcomes_.push_back(outcome);
            ++ended_;
            if (outcomes_.size() == total_) watch_.cancel();
          });
      clients_.push_back(client);
      client->start(endpoint_);
    }
  }

  void watch_stop() {
    watch_.expires_after(std::chrono::milliseconds(100));
    watch_.async_wait([this](const asio::error_code& error) {
      if (error || outcomes_.size() == total_) return;
      if (options_.stop == nullptr || !options_.stop->load()) return watch_stop();
      left_ = 0;
      for (const auto& weak : clients_) {
        if (const auto client = weak.lock()) client->stop({ErrorKind::interrupted, "stopped by the user"});
      }
    });
  }

  const LoadOptions& options_;
  tcp::endpoint endpoint_;
  std::uint32_t total_;
  std::uint32_t left_;  // not started yet
  std::uint32_t slots_;
  std::atomic<std::uint64_t>& bytes_;
  std::atomic<std::uint32_t>& ended_;
  LoadTables tables_{options_};
  std::vector<LoadOutcome> outcomes_;
  std::vector<std::weak_ptr<LoadClient>> clients_;
  asio::io_context io_{1};
  asio::steady_timer watch_{io_};
};

Result<tcp::endpoint> resolve(const ServerAddress& address) {
  asio::io_context io;
  asio::error_code error;
  const auto found =
      tcp::resolver(io).resolve(address.host, std::to_string(address.port), tcp::resolver::numeric_service, error);
  if (error || found.empty()) {
    return fail(ErrorKind::network, address.text() + ": unknown host '" + address.host + "': " + error.message());
  }
  return found.begin()->endpoint();
}

void add_outcomes(const std::vector<LoadOutcome>& outcomes, const ServerAddress& address, LoadReport& report) {
  std::vector<double> connected, head, complete;
  std::set<std::uint64_t> contents;
  for (const LoadOutcome& outcome : outcomes) {
    report.bytes += outcome.bytes;
    report.segments += outcome.segments;
    if (outcome.error) {
      ++report.failures[outcome.error->message];
      if (!report.first_failure) report.first_failure = with_context(*outcome.error, address.text());
      report.interrupted = report.interrupted || outcome.error->kind == ErrorKind::interrupted;
      continue;
    }
    ++report.complete;
    connected.push_back(outcome.connected_ms);
    head.push_back(outcome.head_ms);
    complete.push_back(outcome.complete_ms);
    contents.insert(outcome.content_hash);
  }
  report.distinct_contents = static_cast<std::uint32_t>(contents.size());
  if (!contents.empty()) report.content_hash = *contents.begin();
  report.connected_ms = spread_of(std::move(connected));
  report.head_ms = spread_of(std::move(head));
  report.complete_ms = spread_of(std::move(complete));
}

}  // namespace

Spread spread_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto rank = [&](double fraction) {
    const auto index = static_cast<std::size_t>(std::ceil(fraction * static_cast<double>(values.size())));
    return values[std::clamp<std::size_t>(index, 1, values.size()) - 1];
  };
  return {values.front(), rank(0.5), rank(0.95), values.back()};
}

LoadReport run_load(const LoadOptions& options, const std::function<void(std::uint32_t, std::uint64_t)>& on_progress) {
  LoadReport report;
  report.clients = options.clients;
  const Result<tcp::endpoint> endpoint = resolve(options.address);
  if (!endpoint) {
    report.first_failure = endpoint.error();
    report.failures[endpoint.error().message] = options.clients;
    return report;
  }
  const unsigned wanted =
      options.threads != 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency() / 2);
  const unsigned threads = std::clamp(options.clients, 1U, wanted);
  std::atomic<std::uint64_t> bytes{0};
  std::atomic<std::uint32_t> ended{0};
  std::atomic<unsigned> finished{0};
  const auto started = std::chrono::steady_clock::now();
  std::vector<std::unique_ptr<LoadThread>> parts;
  std::vector<std::thread> running;
  for (unsigned i = 0; i < threads; ++i) {
    const std::uint32_t share = options.clients / threads + (i < options.clients % threads ? 1 : 0);
    parts.push_back(std::make_unique<LoadThread>(options, *endpoint, share, std::max(1U, options.connecting / threads),
                                                 bytes, ended));
    running.emplace_back([&finished, part = parts.back().get()] {
      part->run();
      ++finished;
    });
  }
  auto last_told = started;
  while (finished < threads) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (on_progress && std::chrono::steady_clock::now() - last_told > std::chrono::milliseconds(200)) {
      last_told = std::chrono::steady_clock::now();
      on_progress(ended, bytes);
    }
  }
  for (std::thread& thread : running) thread.join();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  std::vector<LoadOutcome> outcomes;
  for (const auto& part : parts) outcomes.insert(outcomes.end(), part->outcomes().begin(), part->outcomes().end());
  add_outcomes(outcomes, options.address, report);
  return report;
}

}  // namespace fanstream
