#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "client/session/session_transport.h"

namespace fanstream {
namespace {

using Clock = std::chrono::steady_clock;

class StreamedTransport final : public SessionTransport {
 public:
  StreamedTransport(std::unique_ptr<SegmentStream> stream, Clock::time_point begun,
                    std::function<void(const std::string&)> on_notice)
      : stream_(std::move(stream)), begun_(begun), on_notice_(std::move(on_notice)) {}

  Result<void> run_until(double time_s, const OnEvent& on_event) override {
    if (Result<void> begun = receive_sections(on_event); !begun) return begun;
    for (bool first = true;; first = false) {
      const double left_s = time_s - now_s();
      if (left_s <= 0.0 && !first) return {};
      const auto wait_ms = static_cast<TimeMs>(std::clamp(std::ceil(1e3 * left_s), 0.0, 1e3));
      const bool idle = !stream_->wants_outstanding();
      Result<std::optional<StreamEvent>> event = stream_->next_event(wait_ms);
      if (!event) return tl::unexpected(event.error());
      if (*event) {
        if (Result<void> passed = pass_on(**event, on_event); !passed) return passed;
      } else if (idle) {  // a file has nothing to wait for
        std::this_thread::sleep_until(begun_ + std::chrono::duration_cast<Clock::duration>(
                                                   std::chrono::duration<double>(std::min(time_s, now_s() + 0.05))));
      }
    }
  }
  Result<void> use_index(const AssetIndex& index) override { return stream_->use_index(index); }
  void learn_children(const AssetIndex& index, std::uint32_t parent) override {
    stream_->learn_children(index, parent);
  }
  Result<void> want(std::vector<CellRun> runs) override {
    const Result<std::uint32_t> number = stream_->want(std::move(runs));
    if (!number) return tl::unexpected(number.error());
    newest_ = *number;
    return {};
  }
  Result<void> release(const std::vector<CellRun>& runs) override { return stream_->release(runs); }
  double now_s() const override { return std::chrono::duration<double>(Clock::now() - begun_).count(); }
  std::uint64_t received_bytes() const override { return stream_->received_bytes(); }
  const std::string& name() const override { return stream_->name(); }

 private:
  Result<void> receive_sections(const OnEvent& on_event) {
    if (sections_) return {};
    sections_ = true;
    const auto head = stream_->head();
    if (!head) return tl::unexpected(head.error());
    if (Result<void> passed = on_event(event::HeadArrived{*head}, now_s()); !passed) return passed;
    const auto index = stream_->index();
    if (!index) return tl::unexpected(index.error());
    return on_event(event::IndexArrived{*index}, now_s());
  }

  Result<void> pass_on(const StreamEvent& event, const OnEvent& on_event) const {
    if (const auto* segment = std::get_if<event::SegmentArrived>(&event)) {
      return on_event(event::PieceArrived{segment->cell, segment->segment, segment->bytes}, now_s());
    }
    if (const auto* served = std::get_if<event::WantsServed>(&event)) {
      return served->epoch == newest_ ? on_event(event::ListServed{}, now_s()) : Result<void>{};
    }
    if (const auto* degraded = std::get_if<event::ServerDegraded>(&event)) {
      return on_event(hindrance_of(*degraded), now_s());
    }
    if (const auto* lost = std::get_if<event::ConnectionLost>(&event)) {
      return on_event(event::Hindered{text_of(*lost)}, now_s());
    }
    if (const auto* retrying = std::get_if<event::Retrying>(&event)) {
      return on_event(event::Hindered{text_of(*retrying)}, now_s());
    }
    if (const auto* off = std::get_if<event::CacheOff>(&event)) {
      const std::string text = "goes on without the cache: " + off->reason;
      if (on_notice_) on_notice_(text);  // a view that is complete is no worse for it
      return on_event(event::Hindered{text}, now_s());
    }
    if (std::holds_alternative<event::ConnectionResumed>(event)) return on_event(event::Hindered{}, now_s());
    return {};
  }

  std::unique_ptr<SegmentStream> stream_;
  Clock::time_point begun_;
  std::function<void(const std::string&)> on_notice_;
  std::uint32_t newest_ = 0;
  bool sections_ = false;
};

}  // namespace

Result<std::unique_ptr<SegmentStream>> open_stream(const SessionSettings& settings,
                                                   const std::filesystem::path& cache_folder) {
  SegmentStreamOptions options;
  options.network.client.stop = settings.stop;
  if (settings.progress) {
    options.on_building = [&settings](double done) { settings.progress("the server builds the model", done); };
  }
  options.network.on_notice = settings.on_notice;
  options.cache_folder = cache_folder;
  return SegmentStream::open(settings.source, options);
}

Result<std::unique_ptr<SessionTransport>> streamed_transport(const SessionSettings& settings) {
  const Clock::time_point begun = Clock::now();
  Result<std::unique_ptr<SegmentStream>> stream =
      open_stream(settings, settings.cache_folder.value_or(std::filesystem::path()));
  if (!stream) return tl::unexpected(stream.error());
  return std::make_unique<StreamedTransport>(std::move(*stream), begun, settings.on_notice);
}

}  // namespace fanstream
