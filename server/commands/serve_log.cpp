#include "server/commands/serve_log.h"

#include <fmt/format.h>
#include <unistd.h>

namespace fanstream {
namespace {

constexpr auto kProgressInterval = std::chrono::seconds(2);
constexpr auto kStatusInterval = std::chrono::seconds(10);

std::string megabytes(std::uint64_t bytes) { return fmt::format("{:.1f} MB", static_cast<double>(bytes) / 1e6); }

}  // namespace

ServeLog::ServeLog(bool json) : json_(json), on_terminal_(!json && ::isatty(STDERR_FILENO) != 0) {}

void ServeLog::clear_status() {
  if (status_drawn_) fmt::print(stderr, "\r\x1b[K");
  status_drawn_ = false;
}

void ServeLog::line(const std::string& text, const Json& json) {
  clear_status();
  // A log that cannot be written is no reason to stop serving.
  const std::string written = (json_ ? json.dump(-1, ' ', false, Json::error_handler_t::replace) : text) + "\n";
  std::fwrite(written.data(), 1, written.size(), stdout);
  std::fflush(stdout);
}

void ServeLog::listening(const std::string& host, std::uint16_t port, std::size_t models, const std::string& store) {
  const std::lock_guard lock(mutex_);
  const bool v6 = host.find(':') != std::string::npos;
  line(fmt::format("listening on {}{}{}:{}, {} model{}, store {}", v6 ? "[" : "", host, v6 ? "]" : "", port, models,
                   models == 1 ? "" : "s", store),
       {{"event", "listening"}, {"host", host}, {"port", port}, {"models", models}, {"store", store}});
  listening_ = true;
  for (const StoreEvent& event : held_) show(event);
  held_.clear();
}

void ServeLog::store_event(const StoreEvent& event) {
  const std::lock_guard lock(mutex_);
  if (listening_) return show(event);
  if (event.kind != StoreEvent::Kind::progress) held_.push_back(event);
}

void ServeLog::show(const StoreEvent& event) {
  switch (event.kind) {
    case StoreEvent::Kind::building:
      next_progress_ = Clock::now() + kProgressInterval;  // nothing is said of what takes less
      return line(event.model + ": building", {{"event", "building"}, {"model", event.model}});
    case StoreEvent::Kind::progress: {
      building_ = fmt::format("building {:.30} {:.0f} %", event.model, event.fraction * 100.0);
      const Clock::time_point now = Clock::now();
      if (on_terminal_ || now < next_progress_) return;
      next_progress_ = now + kProgressInterval;
      return line(fmt::format("{}: {:.0f} %", event.model, event.fraction * 100.0),
                  {{"event", "progress"}, {"model", event.model}, {"fraction", event.fraction}});
    }
    case StoreEvent::Kind::ready: {
      building_.clear();
      const SegmentSource& asset = *event.source;
      const std::string how =
          event.build_seconds > 0 ? fmt::format("built in {:.1f} s", event.build_seconds) : "in the store";
      return line(fmt::format("{}: ready, {} triangles, {} bytes, {}", event.model, grouped(asset.triangle_count()),
                              grouped(asset.size_bytes()), how),
                  {{"event", "ready"},
                   {"model", event.model},
                   {"digest", text_of(asset.digest())},
                   {"bytes", asset.size_bytes()},
                   {"vertices", asset.vertex_count()},
                   {"triangles", asset.triangle_count()},
                   {"build_seconds", event.build_seconds},
                   {"models_left", event.models_left}});
    }
    case StoreEvent::Kind::failed:
      building_.clear();
      return line(
          fmt::format("{}: cannot be served: {}", event.model, event.text),
          {{"event", "failed"}, {"model", event.model}, {"reason", event.text}, {"models_left", event.models_left}});
    case StoreEvent::Kind::warning:
      return line("note: " + event.text, {{"event", "warning"}, {"model", event.model}, {"text", event.text}});
  }
}

std::string ServeLog::status_text(const ServerMetrics& metrics) const {
  return fmt::format("{} client{} ({} so far, {} failed), {} sent", metrics.sessions_open,
                     metrics.sessions_open == 1 ? "" : "s", metrics.sessions_total, metrics.sessions_failed,
                     megabytes(metrics.sent_bytes));
}

void ServeLog::status(const ServerMetrics& metrics) {
  const std::lock_guard lock(mutex_);
  if (on_terminal_) {
    fmt::print(stderr, "\r\x1b[K{:.79}", status_text(metrics) + (building_.empty() ? "" : ", " + building_));
    std::fflush(stderr);
    status_drawn_ = true;
    return;
  }
  const Clock::time_point now = Clock::now();
  const bool news =
      metrics.sent_bytes != last_status_.sent_bytes || metrics.sessions_open != last_status_.sessions_open;
  if (!news || now < next_status_) return;
  next_status_ = now + kStatusInterval;
  last_status_ = metrics;
  line(status_text(metrics), {{"event", "status"},
                              {"clients", metrics.sessions_open},
                              {"clients_total", metrics.sessions_total},
                              {"clients_failed", metrics.sessions_failed},
                              {"sent_bytes", metrics.sent_bytes},
                              {"sent_segments", metrics.sent_segments}});
}

void ServeLog::stopped(const ServerMetrics& metrics) {
  const std::lock_guard lock(mutex_);
  line(fmt::format("stopped; {} clients, {} sent", metrics.sessions_total, megabytes(metrics.sent_bytes)),
       {{"event", "stopped"}, {"clients_total", metrics.sessions_total}, {"sent_bytes", metrics.sent_bytes}});
}

}  // namespace fanstream
