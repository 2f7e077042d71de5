// What a session is opened with: the transport, and the whole model to compare with.
#include <algorithm>

#include "client/model/source_place.h"
#include "client/session/live_session.h"
#include "common/asset/asset_file.h"
#include "common/refine/full_mesh.h"

namespace fanstream {
namespace {

Result<void> want_all(SegmentStream& stream, const AssetHead& head, const AssetIndex& index) {
  const std::vector<OrderedSegment> order = order_segments(head, index);
  Result<std::uint32_t> wanted = stream.want(wants_for(order, order.size()));
  return wanted ? Result<void>() : tl::unexpected(wanted.error());
}

// Segments and pages, each to its place; of the paged cells when their places are known.
Result<void> receive_pieces(SegmentStream& stream, const AssetHead& head, AssetIndex& index,
                            std::span<std::byte> sections, const SessionSettings& settings) {
  std::uint64_t left = head.has_pages ? index.paged_end - index.paged_offset : 0;
  for (std::uint32_t c = 0; c < std::min<std::size_t>(index.cells.size(), index.first_paged); ++c) {
    for (std::uint32_t i = 0; i < index.piece_count(c); ++i) left += index.piece_bytes(c, i);
  }
  left += index.polygons.size_bytes;
  const std::uint64_t total = left;
  if (Result<void> wanted = want_all(stream, head, index); !wanted) return wanted;
  while (left > 0) {
    Result<std::optional<StreamEvent>> event = stream.next_event(1000);
    if (!event) return tl::unexpected(event.error());
    if (!*event) continue;
    const auto* piece = std::get_if<event::SegmentArrived>(&**event);
    if (piece == nullptr) continue;
    std::copy(piece->bytes.begin(), piece->bytes.end(),
              sections.begin() + static_cast<std::ptrdiff_t>(index.piece_offset(piece->cell, piece->segment)));
    left -= piece->bytes.size();
    if (settings.progress) {
      settings.progress("receiving the whole model", 1.0 - static_cast<double>(left) / static_cast<double>(total));
    }
    if (!index.is_page(piece->cell, piece->segment) || index.unknown_pages == 0) continue;
    if (Result<void> page = read_page(piece->bytes, piece->cell, head, index, stream.name()); !page) return page;
    stream.learn_children(index, piece->cell);
    if (index.unknown_pages != 0) continue;
    if (Result<void> wanted = want_all(stream, head, index); !wanted) return wanted;
  }
  return {};
}

// Everything that a source has, as the bytes of an asset file.
Result<std::vector<std::byte>> receive_file(SegmentStream& stream, const SessionSettings& settings) {
  const auto head = stream.head();
  if (!head) return tl::unexpected(head.error());
  const Result<AssetPreamble> preamble = read_preamble(*head, stream.name());
  if (!preamble) return tl::unexpected(preamble.error());
  const Result<AssetHead> read = read_head(*head, stream.name());
  if (!read) return tl::unexpected(read.error());
  const auto index_bytes = stream.index();
  if (!index_bytes) return tl::unexpected(index_bytes.error());
  Result<AssetIndex> index = read_index(*index_bytes, *preamble, *read, stream.name());
  if (!index) return tl::unexpected(index.error());
  if (Result<void> used = stream.use_index(*index); !used) return tl::unexpected(used.error());
  std::vector<std::byte> sections(preamble->section_bytes());
  std::copy(head->begin(), head->end(), sections.begin());
  std::copy(index_bytes->begin(), index_bytes->end(), sections.begin() + static_cast<std::ptrdiff_t>(head->size()));
  if (Result<void> received = receive_pieces(stream, *read, *index, sections, settings); !received) {
    return tl::unexpected(received.error());
  }
  const std::vector<std::byte> table = range_table(*read, *index);
  std::copy(table.begin(), table.end(), sections.end() - static_cast<std::ptrdiff_t>(table.size()));
  return assemble_file(*preamble, std::span(sections).subspan(kPreambleBytes));
}

Result<std::shared_ptr<const AssetFile>> whole_asset(const SessionSettings& settings, const SourcePlace& place) {
  if (!place.server) return AssetFile::open(place.file);
  Result<std::unique_ptr<SegmentStream>> stream = open_stream(settings);
  if (!stream) return tl::unexpected(stream.error());
  Result<std::vector<std::byte>> bytes = receive_file(**stream, settings);
  if (!bytes) return tl::unexpected(bytes.error());
  return AssetFile::from_memory(std::move(*bytes), settings.source);
}

// What can be said of a model before it has come: its grid encloses it tightly.
Result<OpenedSession> describe(const SessionSettings& settings) {
  Result<std::unique_ptr<SegmentStream>> stream = open_stream(settings);
  if (!stream) return tl::unexpected(stream.error());
  const auto bytes = (*stream)->head();
  if (!bytes) return tl::unexpected(bytes.error());
  const Result<AssetHead> head = read_head(*bytes, (*stream)->name());
  if (!head) return tl::unexpected(head.error());
  const PositionGrid& grid = head->grid;
  OpenedSession opened;
  opened.model = (*stream)->model();
  opened.digest = text_of((*stream)->digest());
  opened.grid_step = grid.step();
  opened.bounds = grid.bounds();
  return opened;
}

Result<OpenedSession> open_by_the_clock(const SessionSettings& settings) {
  Result<OpenedSession> opened = describe(settings);
  if (!opened) return opened;
  Result<std::unique_ptr<SessionTransport>> transport = streamed_transport(settings);
  if (!transport) return tl::unexpected(transport.error());
  opened->session = live_session(std::move(*transport), settings);
  return opened;
}

}  // namespace

Result<OpenedSession> open_live_session(const SessionSettings& settings) {
  if (!settings.whole_model && settings.real_time) return open_by_the_clock(settings);
  const Result<SourcePlace> place = locate_source(settings.source);
  if (!place) return tl::unexpected(place.error());
  Result<std::shared_ptr<const AssetFile>> asset = whole_asset(settings, *place);
  if (!asset) return tl::unexpected(asset.error());
  OpenedSession opened;
  opened.model = place->server ? place->server->model : place->file.stem().string();
  opened.digest = text_of((*asset)->digest());
  opened.grid_step = (*asset)->asset_head()->grid.step();
  Result<std::unique_ptr<ProgressiveMesh>> full = load_full(**asset);
  if (!full) return tl::unexpected(full.error());
  opened.full = (*full)->triangle_mesh();
  opened.bounds = (*asset)->asset_head()->grid.bounds();
  std::unique_ptr<SessionTransport> transport;
  if (settings.real_time) {
    Result<std::unique_ptr<SessionTransport>> streamed = streamed_transport(settings);
    if (!streamed) return tl::unexpected(streamed.error());
    transport = std::move(*streamed);
  } else {
    transport = simulated_transport(*asset, settings.link, opened.model);
  }
  opened.session = live_session(std::move(transport), settings);
  return opened;
}

}  // namespace fanstream
