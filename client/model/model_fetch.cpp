#include "client/model/model_fetch.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "common/asset/asset_file.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace fanstream {
namespace {

constexpr std::size_t kRefineBytes = 64 * 1024;  // received between two refinements on the way to the whole model

std::int64_t now_us() {
  using std::chrono::steady_clock;
  return std::chrono::duration_cast<std::chrono::microseconds>(steady_clock::now().time_since_epoch()).count();
}

}  // namespace

// Segments come in the file's order, so the asset's digest can be checked on the way.
struct ModelFetch::ContentHash {
  ContentHash() { XXH3_128bits_reset(&state); }
  void add(std::span<const std::byte> bytes) { XXH3_128bits_update(&state, bytes.data(), bytes.size()); }
  Digest digest() const {
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(&state));
    Digest digest{};
    std::copy(std::begin(canonical.digest), std::end(canonical.digest), digest.begin());
    return digest;
  }
  XXH3_state_t state;
};

ModelFetch::ModelFetch(FetchOptions options)
    : options_(std::move(options)), hash_(std::make_shared<ContentHash>()), started_us_(now_us()) {}

double ModelFetch::elapsed_s() const { return static_cast<double>(now_us() - started_us_) * 1e-6; }

Result<std::unique_ptr<ModelFetch>> ModelFetch::open(const std::string& source, const FetchOptions& options) {
  std::unique_ptr<ModelFetch> fetch(new ModelFetch(options));
  if (Result<void> received = fetch->receive_base(source); !received) return tl::unexpected(received.error());
  return fetch;
}

Result<void> ModelFetch::receive_base(const std::string& source) {
  Result<std::unique_ptr<ModelSource>> opened = ModelSource::open(source, options_.source);
  if (!opened) return tl::unexpected(opened.error());
  source_ = std::move(*opened);
  report_.seconds.connect = elapsed_s();
  const std::string& name = source_->name();
  const Result<std::span<const std::byte>> bytes = source_->head();
  if (!bytes) return tl::unexpected(bytes.error());
  report_.seconds.head = elapsed_s();
  const Result<AssetPreamble> preamble = read_preamble(*bytes, name);
  if (!preamble) return tl::unexpected(preamble.error());
  preamble_ = *preamble;
  if (preamble_.digest != source_->digest() || preamble_.head_bytes != source_->head_size_bytes() ||
      preamble_.index_bytes != source_->index_size_bytes()) {
    return fail(ErrorKind::bad_input, name + ": the head is of another asset than was announced");
  }
  Result<AssetHead> head = read_head(*bytes, name);
  if (!head) return tl::unexpected(head.error());
  hash_->add(bytes->subspan(kPreambleBytes));
  mesh_ = std::make_unique<ProgressiveMesh>(std::make_shared<const AssetHead>(std::move(*head)));
  report_.bytes.head = bytes->size();
  report_.seconds.first_mesh = report_.seconds.complete = elapsed_s();
  return {};
}

Result<void> ModelFetch::receive_index() {
  if (mesh_->has_index()) return {};
  const Result<std::span<const std::byte>> bytes = source_->index();
  if (!bytes) return tl::unexpected(bytes.error());
  Result<AssetIndex> index = read_index(*bytes, preamble_, mesh_->head(), source_->name());
  if (!index) return tl::unexpected(index.error());
  hash_->add(*bytes);
  report_.bytes.index = bytes->size();
  if (Result<void> used = source_->use_index(*index); !used) return used;
  index_ = std::make_shared<AssetIndex>(std::move(*index));
  mesh_->set_index(index_);
  order_ = order_segments(mesh_->head(), *index_);
  for (std::uint32_t c = 0; c < index_->cells.size(); ++c) report_.segments_total += index_->piece_count(c);
  return {};
}

std::size_t ModelFetch::end_for_bytes(std::uint64_t bytes) const {
  const std::uint64_t spent = source_->received_bytes() + source_->slack_bytes();
  std::uint64_t segments = 0, size_bytes = 0;
  std::size_t end = taken_;
  for (; end < order_.size(); ++end) {
    segments += order_[end].size_bytes == 0 ? 0 : 1;
    size_bytes += order_[end].size_bytes;
    if (spent + source_->cost_bytes(segments, size_bytes) > bytes) break;
  }
  return end;
}

void ModelFetch::tell(const FetchGoal& goal) const {
  if (!options_.on_progress) return;
  const std::uint64_t full = mesh_->head().vertex_count;
  options_.on_progress(
      {mesh_->vertex_count(), std::min<std::uint64_t>(full, goal.vertices.value_or(full)), source_->received_bytes(),
       std::min<std::uint64_t>(preamble_.section_bytes(), goal.bytes.value_or(preamble_.section_bytes()))});
}

// A segment, or a page: with the last of the pages the order goes on.
Result<void> ModelFetch::take_piece(const OrderedSegment& piece, std::span<const std::byte> bytes) {
  if (piece.layer != kPageLayer) return mesh_->add_segment(piece.cell, piece.segment, bytes);
  if (index_->knows_children(piece.cell)) return {};
  if (Result<void> read = read_page(bytes, piece.cell, mesh_->head(), *index_, "the cell table"); !read) return read;
  source_->learn_children(*index_, piece.cell);
  mesh_->learn_children(piece.cell);
  if (index_->unknown_pages == 0) {
    const std::vector<OrderedSegment> whole = order_segments(mesh_->head(), *index_);
    order_.insert(order_.end(), whole.begin() + static_cast<std::ptrdiff_t>(order_.size()), whole.end());
  }
  return {};
}

// Receives segments up to `end` of the order and applies them.
Result<void> ModelFetch::take(std::size_t end, const FetchGoal& goal) {
  std::size_t bytes_since = 0;
  std::optional<Error> broken;
  while (taken_ < end && !broken) {
    const auto next = source_->next_segment();
    if (!next || !*next) {
      broken = next ? Error{ErrorKind::bad_input, source_->name() + ": segments are missing"} : next.error();
      break;
    }
    const std::span<const std::byte> bytes = **next;
    const OrderedSegment segment = order_[taken_];
    if (const Result<void> added = take_piece(segment, bytes); !added) {
      broken = with_context(added.error(), source_->name());
      break;
    }
    hash_->add(bytes);
    ++taken_;
    report_.bytes.segments += bytes.size();
    bytes_since += bytes.size();
    if (bytes_since < kRefineBytes || goal.vertices) continue;
    bytes_since = 0;
    if (const Result<std::uint64_t> refined = mesh_->refine(); !refined)
      broken = with_context(refined.error(), source_->name());
    tell(goal);
  }
  const std::uint64_t limit = std::min<std::uint64_t>(goal.vertices.value_or(kMostVertices), kMostVertices);
  if (const Result<std::uint64_t> refined = mesh_->refine(static_cast<std::uint32_t>(limit)); !refined && !broken) {
    broken = with_context(refined.error(), source_->name());
  }
  tell(goal);
  if (broken) return tl::unexpected(*broken);
  return {};
}

Result<void> ModelFetch::advance_to_position(std::size_t end, const FetchGoal& goal) {
  if (end > wanted_) {
    if (Result<void> asked = source_->want(order_, end); !asked) return asked;
    wanted_ = end;
  }
  return take(end, goal);
}

// Everything, or as much as fits: on past the pages, which make the order longer.
Result<void> ModelFetch::advance_to_end(const FetchGoal& goal) {
  for (;;) {
    const std::size_t known = order_.size();
    const std::size_t end = goal.bytes ? end_for_bytes(*goal.bytes) : known;
    if (Result<void> reached = advance_to_position(end, goal); !reached) return reached;
    if (end < known || order_.size() == known) return {};
  }
}

// Layer by layer, and within the last one generation by generation, so that the level is equally fine everywhere.
Result<void> ModelFetch::advance_to_vertices(std::uint64_t vertices) {
  const FetchGoal goal{vertices, {}};
  // An earlier, smaller goal may have left segments that are held but not applied.
  if (Result<void> applied = take(taken_, goal); !applied) return applied;
  while (mesh_->vertex_count() < vertices && taken_ < order_.size()) {
    std::size_t end = taken_;
    while (end < order_.size() && order_[end].layer == order_[taken_].layer) ++end;
    if (Result<void> reached = advance_to_position(end, goal); !reached) return reached;
  }
  return {};
}

Result<void> ModelFetch::finish(const FetchGoal& goal) {
  report_.seconds.complete = elapsed_s();
  if (!mesh_->has_index() || taken_ < order_.size() || verified_) return {};
  if (!mesh_->is_complete()) {
    if (goal.vertices && mesh_->vertex_count() >= *goal.vertices) return {};
    return fail(ErrorKind::bad_input, fmt::format("{}: all segments came, but refinement stops at {} of {} vertices",
                                                  source_->name(), mesh_->vertex_count(), mesh_->head().vertex_count));
  }
  hash_->add(range_table(mesh_->head(), *index_));
  if (hash_->digest() != preamble_.digest) {
    return fail(ErrorKind::bad_input,
                source_->name() + ": what came does not have the digest that was announced; fetch it again");
  }
  verified_ = true;
  return {};
}

Error ModelFetch::described(const Error& error) const {
  const FetchReport now = report();
  std::string share =
      now.segments_total == 0 ? "no segments" : fmt::format("{} of {} segments", now.segments, now.segments_total);
  return {error.kind, fmt::format("{}; {} bytes and {} were received, the mesh has {} of {} vertices", error.message,
                                  now.bytes.received, share, now.vertices, now.full_vertices)};
}

Result<void> ModelFetch::advance(const FetchGoal& goal) {
  if (failed_) return fail(ErrorKind::usage, source_->name() + ": an earlier error ended this transfer");
  const bool base_is_enough =
      (goal.vertices && *goal.vertices <= mesh_->vertex_count()) ||
      (goal.bytes && !mesh_->has_index() && *goal.bytes < preamble_.head_bytes + preamble_.index_bytes);
  Result<void> done;
  if (!base_is_enough) {
    done = receive_index();
    if (done) {
      done = goal.vertices ? advance_to_vertices(*goal.vertices) : advance_to_end(goal);
    }
  }
  if (done) done = finish(goal);
  if (done) return done;
  failed_ = true;
  report_.seconds.complete = elapsed_s();
  return tl::unexpected(described(done.error()));
}

FetchReport ModelFetch::report() const {
  FetchReport report = report_;
  report.source = source_->name();
  report.model = source_->model();
  report.digest = text_of(preamble_.digest);
  report.bytes.received = source_->received_bytes();
  report.segments = taken_;
  report.vertices = mesh_->vertex_count();
  report.triangles = mesh_->state().fans.triangles().size();
  report.full_vertices = mesh_->head().vertex_count;
  report.full_triangles = mesh_->head().triangle_count;
  report.complete = verified_;
  return report;
}

}  // namespace fanstream
