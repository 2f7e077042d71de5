#include <algorithm>
#include <cmath>

#include "client/model/segment_order.h"
#include "client/session/session_transport.h"
#include "client/session/simulated_connection.h"

namespace fanstream {
namespace {

class SimulatedTransport final : public SessionTransport {
 public:
  SimulatedTransport(std::shared_ptr<const SegmentSource> asset, const VirtualLinkOptions& link, std::string name)
      : name_(std::move(name)), connection_(std::move(asset), options_for(link)) {
    connection_.open(name_);
  }

  Result<void> run_until(double time_s, const OnEvent& on_event) override {
    Result<void> handled;
    const auto handle = [&](const ClientEvent& event, TimeUs now_us) {
      if (handled) handled = pass_on(event, 1e-6 * static_cast<double>(now_us), on_event);
    };
    const auto until_us = std::max(connection_.now_us(), static_cast<TimeUs>(std::llround(1e6 * time_s)));
    Result<void> ran = connection_.run_until(until_us, handle);
    return handled ? ran : handled;
  }
  Result<void> use_index(const AssetIndex& index) override {
    table_ = segment_table(index);
    return connection_.set_segment_table(table_);
  }
  void learn_children(const AssetIndex& index, std::uint32_t parent) override {
    fanstream::learn_children(index, parent, *table_);
  }
  Result<void> want(std::vector<CellRun> runs) override {
    const Result<std::uint32_t> epoch = connection_.set_wants(std::move(runs));
    if (!epoch) return tl::unexpected(epoch.error());
    return {};
  }
  Result<void> release(const std::vector<CellRun>& runs) override { return connection_.release(runs); }
  double now_s() const override { return 1e-6 * static_cast<double>(connection_.now_us()); }
  std::uint64_t received_bytes() const override { return connection_.received_bytes(); }
  const std::string& name() const override { return name_; }

 private:
  static SimulatedConnectionOptions options_for(const VirtualLinkOptions& link) {
    SimulatedConnectionOptions options;
    options.link = link;
    return options;
  }

  Result<void> pass_on(const ClientEvent& event, double now_s, const OnEvent& on_event) {
    if (std::holds_alternative<event::HeadComplete>(event)) {
      return on_event(event::HeadArrived{connection_.client().head()}, now_s);
    }
    if (std::holds_alternative<event::IndexComplete>(event)) {
      return on_event(event::IndexArrived{connection_.client().index()}, now_s);
    }
    if (const auto* segment = std::get_if<event::SegmentArrived>(&event)) {
      return on_event(event::PieceArrived{segment->cell, segment->segment, segment->bytes}, now_s);
    }
    if (const auto* served = std::get_if<event::WantsServed>(&event)) {
      return served->epoch == connection_.client().set_epoch() ? on_event(event::ListServed{}, now_s) : Result<void>{};
    }
    if (const auto* degraded = std::get_if<event::ServerDegraded>(&event)) {
      return on_event(hindrance_of(*degraded), now_s);
    }
    return {};
  }

  std::string name_;
  SimulatedConnection connection_;
  std::shared_ptr<SegmentTable> table_;
};

}  // namespace

std::unique_ptr<SessionTransport> simulated_transport(std::shared_ptr<const SegmentSource> asset,
                                                      const VirtualLinkOptions& link, std::string name) {
  return std::make_unique<SimulatedTransport>(std::move(asset), link, std::move(name));
}

}  // namespace fanstream
