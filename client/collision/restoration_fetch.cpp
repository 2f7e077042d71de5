#include "client/collision/restoration_fetch.h"

#include "client/model/segment_order.h"

namespace fanstream {

Result<std::unique_ptr<RestorationFetch>> RestorationFetch::open(const std::string& source,
                                                                 const RestorationFetchOptions& options) {
  Result<std::unique_ptr<SegmentStream>> stream = SegmentStream::open(source, options.stream);
  if (!stream) return tl::unexpected(stream.error());
  std::unique_ptr<RestorationFetch> fetch(new RestorationFetch(std::move(*stream), options));
  if (Result<void> received = fetch->receive_sections(); !received) return tl::unexpected(received.error());
  return fetch;
}

Result<void> RestorationFetch::receive_sections() {
  const auto head_bytes = stream_->head();
  if (!head_bytes) return tl::unexpected(head_bytes.error());
  const Result<AssetPreamble> preamble = read_preamble(*head_bytes, name());
  if (!preamble) return tl::unexpected(preamble.error());
  preamble_ = *preamble;
  Result<AssetHead> head = read_head(*head_bytes, name());
  if (!head) return tl::unexpected(head.error());
  const auto index_bytes = stream_->index();
  if (!index_bytes) return tl::unexpected(index_bytes.error());
  Result<AssetIndex> index = read_index(*index_bytes, preamble_, *head, name());
  if (!index) return tl::unexpected(index.error());
  if (Result<void> used = stream_->use_index(*index); !used) return used;
  std::vector<ReceivedSegment> early;
  if (Result<void> known = receive_pages(*head, *index, early); !known) return known;
  model_ = std::make_unique<LocalRestoration>(std::make_shared<const AssetHead>(std::move(*head)),
                                              std::make_shared<const AssetIndex>(std::move(*index)));
  for (const ReceivedSegment& s : early) {
    if (Result<void> added = model_->add_segment(s.cell, s.segment, s.bytes); !added) {
      return tl::unexpected(with_context(added.error(), name()));
    }
  }
  return {};
}

// The search looks at all cells, so that all pages are needed, and with each the segments of its cell.
Result<void> RestorationFetch::receive_pages(const AssetHead& head, AssetIndex& index,
                                             std::vector<ReceivedSegment>& early) {
  if (index.unknown_pages == 0) return {};
  std::vector<OrderedSegment> order = order_segments(head, index);
  std::erase_if(order, [](const OrderedSegment& piece) { return piece.layer != kPageLayer; });
  const Result<std::uint32_t> number = stream_->want(wants_for(order, order.size()));
  if (!number) return tl::unexpected(number.error());
  return receive_wanted(*number, [&](const event::SegmentArrived& piece) -> Result<void> {
    if (!index.is_page(piece.cell, piece.segment)) {
      early.push_back({piece.cell, piece.segment, {piece.bytes.begin(), piece.bytes.end()}});
      return {};
    }
    if (Result<void> read = read_page(piece.bytes, piece.cell, head, index, name()); !read) return read;
    stream_->learn_children(index, piece.cell);
    return {};
  });
}

// Cells are numbered coarse to fine, which is the order in which they are of use.
Result<void> RestorationFetch::receive(const std::vector<CellTarget>& missing) {
  std::vector<CellPrefix> list;
  list.reserve(missing.size());
  for (const CellTarget& m : missing) list.push_back({m.cell, m.segments});
  const Result<std::uint32_t> number = stream_->want(to_runs(list));
  if (!number) return tl::unexpected(number.error());
  return receive_wanted(*number, [this](const event::SegmentArrived& segment) -> Result<void> {
    if (Result<void> added = model_->add_segment(segment.cell, segment.segment, segment.bytes); !added) {
      return tl::unexpected(with_context(added.error(), name()));
    }
    if (options_.on_progress) options_.on_progress(received_bytes(), model_bytes());
    return {};
  });
}

Result<void> RestorationFetch::receive_wanted(std::uint32_t number,
                                              const std::function<Result<void>(const event::SegmentArrived&)>& take) {
  constexpr TimeMs kPatienceMs = 200;
  for (;;) {
    if (options_.stream.network.client.stop != nullptr && options_.stream.network.client.stop->load()) {
      return fail(ErrorKind::interrupted, "stopped by the user");
    }
    const Result<std::optional<StreamEvent>> event = stream_->next_event(kPatienceMs);
    if (!event) return tl::unexpected(event.error());
    if (!*event) continue;
    if (const auto* segment = std::get_if<event::SegmentArrived>(&**event)) {
      if (Result<void> taken = take(*segment); !taken) return taken;
    } else if (const auto* served = std::get_if<event::WantsServed>(&**event)) {
      if (served->epoch == number) return {};
    }
  }
}

Result<RestorationMove> RestorationFetch::move(const Focus& focus) {
  RestorationMove sum;
  std::vector<CellTarget> asked;
  for (;;) {
    RestorationMove move = model_->move(focus);
    if (!move.damage.empty()) return tl::unexpected(with_context(move.damage.front().error, name()));
    sum.applied += move.applied;
    sum.undone += move.undone;
    sum.focus_cells = move.focus_cells;
    sum.covered = move.covered;
    const std::vector<CellTarget> missing = model_->missing();
    if (missing.empty()) return sum;
    const auto same = [](const CellTarget& a, const CellTarget& b) {
      return a.cell == b.cell && a.segments == b.segments;
    };
    if (std::equal(missing.begin(), missing.end(), asked.begin(), asked.end(), same)) {
      return fail(ErrorKind::bad_input, name() + ": cell " + std::to_string(missing.front().cell) +
                                            " was asked for and all was said to be sent, but it is not complete");
    }
    asked = missing;
    if (Result<void> received = receive(missing); !received) return tl::unexpected(received.error());
  }
}

}  // namespace fanstream
