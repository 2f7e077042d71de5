#include "protocol/client_session.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace fanstream {
namespace {

constexpr std::uint32_t kLeastWindowBytes = 3 * kMaxChunkBytes / 2;  // less a quarter, a frame still fits
constexpr std::uint32_t kFirstWindowBytes = 256 * 1024;
constexpr std::uint32_t kSpareWindowBytes = 48 * 1024;
constexpr std::size_t kProgressBytes = 1024;  // of a frame that is not complete
constexpr TimeMs kMeasuringPingMs = 1'000;
constexpr TimeMs kAwayMs = 2'000;  // a gap between ticks above this is the driver's own absence

}  // namespace

ClientSession::ClientSession(const ClientSessionOptions& options, TimeMs now_ms)
    : options_(options),
      window_bytes_(options.adaptive_window ? std::min(options.window_bytes, kFirstWindowBytes) : options.window_bytes),
      last_tick_ms_(now_ms),
      last_progress_ms_(now_ms),
      last_received_ms_(now_ms) {
  assert(options.window_bytes >= kLeastWindowBytes);
  reader_.restrict_to(FrameType::welcome);
  encode(Hello{options.version_min, options.version_max, 0}, output_);
}

void ClientSession::list() {
  assert(welcomed_);
  list_pending_ = true;
  ++catalogues_to_come_;
  progressed_ = true;
  write_frame(FrameType::list, {}, output_);
}

Result<void> ClientSession::open(std::string model, std::optional<Have> have) {
  if (model.empty() || model.size() > kMaxNameBytes || !is_printable_utf8(model)) {
    return fail(ErrorKind::usage, "a model name is 1 to 255 bytes of printable UTF-8");
  }
  if (opening_ || model_) return fail(ErrorKind::usage, "a session serves one model; connect again for the next");
  if (have) {
    if (Result<void> valid = check_runs(have->cells); !valid) return valid;
  }
  if (!welcomed_) grant_up_to_window();
  encode(Open{model, have}, output_);
  opening_ = std::move(model);
  have_ = std::move(have);
  progressed_ = true;
  return {};
}

Result<std::uint32_t> ClientSession::set_wants(std::vector<CellRun> runs) {
  if (!opening_ && !model_) return fail(ErrorKind::usage, "wants need an open model");
  if (Result<void> valid = check_runs(runs); !valid) return tl::unexpected<Error>(valid.error());
  if (set_epoch_ == 0xFFFFFFFFU) return fail(ErrorKind::limit, "a session takes 2^32 - 1 lists of wants");
  if (!wants_outstanding()) {
    progressed_ = true;
    link_.pause();
  }
  wants_frame_.clear();
  note_wanted(runs);
  Wants wants{++set_epoch_, std::move(runs)};
  encode(wants, wants_frame_);
  list_ = std::move(wants.runs);
  released_since_list_.clear();
  return set_epoch_;
}

// What may arrive from now on. A list may be set before it is known which cells there are.
void ClientSession::note_wanted(const std::vector<CellRun>& runs) {
  if (!model_) {
    early_wants_many_ = early_wants_many_ || early_wants_.size() + runs.size() > 4 * kMaxRuns;
    if (!early_wants_many_) early_wants_.insert(early_wants_.end(), runs.begin(), runs.end());
    return;
  }
  for (const CellRun& run : runs) {
    const std::uint64_t end = std::min<std::uint64_t>(std::uint64_t{run.first_cell} + run.cell_count, wanted_.size());
    for (std::uint64_t cell = run.first_cell; cell < end; ++cell) wanted_[cell] = std::max(wanted_[cell], run.prefix);
  }
}

Result<void> ClientSession::set_segment_table(std::shared_ptr<const SegmentTable> table) {
  assert(index_told_ && table);
  if (table->cell_count() != held_.size() || table->segment_total() != model_->segment_total) {
    return fail(ErrorKind::bad_input, "the index has " + std::to_string(table->cell_count()) + " cells with " +
                                          std::to_string(table->segment_total()) + " segments, the server said " +
                                          std::to_string(held_.size()) + " with " +
                                          std::to_string(model_->segment_total));
  }
  table_ = std::move(table);
  for (std::uint32_t cell = 0; cell < held_.size(); ++cell) {
    held_[cell] = std::min(held_[cell], table_->segment_count(cell));
    sent_[cell] = std::min(sent_[cell], table_->segment_count(cell));
  }
  return {};
}

Result<void> ClientSession::release(const std::vector<CellRun>& runs) {
  if (!model_) return fail(ErrorKind::usage, "release needs an open model");
  if (Result<void> valid = check_each_run(runs); !valid) return valid;
  for (const CellRun& run : runs) {
    if (std::uint64_t{run.first_cell} + run.cell_count <= held_.size()) continue;
    return fail(ErrorKind::usage, "release names cell " + std::to_string(run.first_cell + run.cell_count - 1) +
                                      ", the model has " + std::to_string(held_.size()));
  }
  if (runs.size() > 0xFFFFFFFFU - releases_made_) return fail(ErrorKind::limit, "a session takes 2^32 - 1 releases");
  std::vector<CellPrefix> dropped;
  for (const CellRun& run : runs) {
    for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell) {
      if (held_[cell] <= run.prefix) continue;
      held_[cell] = run.prefix;
      dropped.push_back({cell, run.prefix});
    }
  }
  const std::vector<CellRun> packed = to_runs(dropped);
  if (wants_outstanding()) released_since_list_.insert(released_since_list_.end(), packed.begin(), packed.end());
  for (std::vector<CellRun>& list : split_runs(packed)) {
    Release release{std::move(list)};
    encode(release, output_);
    releases_.push_back(std::move(release.runs));
    ++releases_made_;
  }
  return {};
}

void ClientSession::commit(std::size_t size_bytes, TimeMs now_ms) {
  reader_.commit(size_bytes);
  received_bytes_ += size_bytes;
  if (size_bytes == 0) return;
  last_received_ms_ = now_ms;
  measure_arrival(size_bytes, now_ms);
}

void ClientSession::receive(Bytes bytes, TimeMs now_ms) {
  const std::span<std::byte> room = reader_.prepare(bytes.size());
  std::copy(bytes.begin(), bytes.end(), room.begin());
  commit(bytes.size(), now_ms);
}

void ClientSession::transport_closed(std::string_view why) {
  if (!closed_) closed_ = std::string(why);
}

ClientEvent ClientSession::fail_with(ErrorKind kind, std::string message) {
  if (!failure_) failure_ = Error{kind, std::move(message)};
  failure_told_ = true;
  return event::Failed{*failure_};
}

Error ClientSession::unexpected_error(FrameType type, std::string_view why) const {
  return {ErrorKind::bad_input, "the server sent " + name(type) + " " + std::string(why) + " (before stream byte " +
                                    std::to_string(reader_.offset_bytes()) + ")"};
}

ClientEvent ClientSession::unexpected(FrameType type, std::string_view why) {
  Error error = unexpected_error(type, why);
  return fail_with(error.kind, std::move(error.message));
}

std::string_view ClientSession::awaiting() const {
  if (!welcomed_) return "the server's welcome";
  if (list_pending_) return "the catalogue";
  if (opening_) return "the model to be opened";
  if (model_ && !head_told_) return "the model's head";
  if (model_ && !index_told_) return "the model's index";
  if (wants_outstanding()) return "wanted segments";
  return "";
}

bool ClientSession::awaits_something() const { return !awaiting().empty(); }

std::optional<ClientEvent> ClientSession::next_event() {
  if (failure_) {
    if (failure_told_) return std::nullopt;
    return fail_with(failure_->kind, failure_->message);
  }
  if (std::optional<ClientEvent> event = completed_blob()) return event;
  if (std::optional<ClientEvent> event = give_arrived()) return event;
  for (;;) {
    const Result<std::optional<FrameView>> frame = reader_.next();
    if (!frame) {
      std::string message = frame.error().message;
      if (!welcomed_) message += "; is this a Fanstream server?";
      return fail_with(frame.error().kind, std::move(message));
    }
    if (!*frame) break;
    partial_bytes_ = 0;
    if (std::optional<ClientEvent> event = handle(**frame)) return event;
  }
  if (reader_.buffered_bytes() >= partial_bytes_ + kProgressBytes) {  // over a slow link a frame takes its time
    partial_bytes_ = reader_.buffered_bytes();
    progressed_ = true;
  }
  if (!closed_) return std::nullopt;
  std::string message = *closed_ + " after " + std::to_string(received_bytes_) + " bytes";
  if (reader_.mid_frame()) message += ", in the middle of a frame";
  if (awaits_something()) message += ", while waiting for " + std::string(awaiting());
  return fail_with(ErrorKind::network, std::move(message));
}

std::optional<ClientEvent> ClientSession::handle(const FrameView& frame) {
  const auto bad = [&](const Error& error) { return fail_with(error.kind, error.message); };
  if (frame.type != FrameType::ping && frame.type != FrameType::pong) progressed_ = true;
  switch (frame.type) {
    case FrameType::welcome: return handle_welcome(frame.payload);
    case FrameType::catalogue: return handle_catalogue(frame.payload);
    case FrameType::opened: return handle_opened(frame.payload);
    case FrameType::head_data:
    case FrameType::index_data: return handle_blob(frame.type, frame.payload);
    case FrameType::segments: return handle_segments(frame.payload);
    case FrameType::segment_part: return handle_segment_part(frame.payload);
    case FrameType::wants_done: return handle_wants_done(frame.payload);
    case FrameType::error: return handle_error(frame.payload);
    case FrameType::building: {
      const Result<Building> building = decode_building(frame.payload);
      if (!building) return bad(building.error());
      if (!opening_) return unexpected(frame.type, "although no open is pending");
      return event::BuildingModel{building->permille / 1000.0};
    }
    case FrameType::degraded: {
      Result<Degraded> degraded = decode_degraded(frame.payload);
      if (!degraded) return bad(degraded.error());
      return event::ServerDegraded{degraded->reason, std::move(degraded->text)};
    }
    case FrameType::ping:
    case FrameType::pong: {
      const Result<Ping> ping = decode_ping(frame.payload);
      if (!ping) return bad(ping.error());
      // A server that pings without reading the answers would otherwise fill our memory.
      if (output_.size() - output_sent_ > kMaxRunsBytes) return unexpected(frame.type, "without reading our answers");
      if (frame.type == FrameType::ping) {
        encode(FrameType::pong, *ping, output_);
      } else if (ping->token == static_cast<std::uint64_t>(last_ping_ms_)) {
        link_.round_trip(last_received_ms_ - last_ping_ms_, last_received_ms_);
      }
      return std::nullopt;
    }
    default: return unexpected(frame.type, "which only clients send");
  }
}

std::optional<ClientEvent> ClientSession::handle_welcome(Bytes payload) {
  if (welcomed_) return unexpected(FrameType::welcome, "twice");
  const Result<Welcome> welcome = decode_welcome(payload);
  if (!welcome) return fail_with(welcome.error().kind, welcome.error().message + "; is this a Fanstream server?");
  if (welcome->version < options_.version_min || welcome->version > options_.version_max) {
    return fail_with(ErrorKind::unsupported, "the server chose protocol version " + std::to_string(welcome->version) +
                                                 ", which we did not offer");
  }
  welcomed_ = true;
  reader_.restrict_to(std::nullopt);
  grant_up_to_window();
  if (options_.adaptive_window) ping(last_received_ms_);  // little else is under way: it measures the bare link
  return event::Welcomed{welcome->version};
}

std::optional<ClientEvent> ClientSession::handle_catalogue(Bytes payload) {
  Result<CataloguePart> part = decode_catalogue(payload);
  if (!part) return fail_with(part.error().kind, part.error().message);
  if (catalogues_to_come_ == 0) return unexpected(FrameType::catalogue, "without being asked");
  if (catalogue_.size() + part->entries.size() > kMaxCatalogueEntries) {
    return fail_with(ErrorKind::limit, "the server's catalogue has more than 65536 entries");
  }
  for (CatalogueEntry& entry : part->entries) catalogue_.push_back(std::move(entry));
  if (!part->last) return std::nullopt;
  list_pending_ = false;  // one answer serves all requests before it; one that crossed it has an answer of its own
  --catalogues_to_come_;
  return event::Catalogue{std::exchange(catalogue_, {})};
}

std::optional<ClientEvent> ClientSession::handle_opened(Bytes payload) {
  const Result<Opened> opened = decode_opened(payload);
  if (!opened) return fail_with(opened.error().kind, opened.error().message);
  if (!opening_) return unexpected(FrameType::opened, "although no open is pending");
  if (opened->resumed && (!have_ || have_->digest != opened->digest)) {
    return unexpected(FrameType::opened, "as resumed, of an asset that we do not hold");
  }
  if (std::max(opened->head_size_bytes, opened->index_size_bytes) > options_.max_head_bytes) {
    return fail_with(ErrorKind::limit, "model '" + *opening_ + "' has a head of " +
                                           std::to_string(opened->head_size_bytes) + " and an index of " +
                                           std::to_string(opened->index_size_bytes) + " bytes, the limit is " +
                                           std::to_string(options_.max_head_bytes));
  }
  held_.assign(opened->cell_count, 0);
  wanted_.assign(opened->cell_count, early_wants_many_ ? kAllSegments : 0);
  if (opened->resumed) {
    for (const CellRun& run : have_->cells) {
      if (std::uint64_t{run.first_cell} + run.cell_count > held_.size()) {
        return unexpected(FrameType::opened, "as resumed, with fewer cells than we hold");
      }
      std::fill_n(held_.begin() + run.first_cell, run.cell_count, run.prefix);
    }
    head_told_ = have_->head;
    index_told_ = have_->index;
  }
  sent_ = held_;
  model_ = *opened;
  note_wanted(std::exchange(early_wants_, {}));
  opening_.reset();
  have_.reset();
  return event::ModelOpened{*model_};
}

// Head and index may be empty: then no frame announces them.
std::optional<ClientEvent> ClientSession::completed_blob() {
  if (!model_) return std::nullopt;
  if (!head_told_ && head_.size() == model_->head_size_bytes) {
    head_told_ = true;
    return event::HeadComplete{};
  }
  if (head_told_ && !index_told_ && index_.size() == model_->index_size_bytes) {
    index_told_ = true;
    return event::IndexComplete{};
  }
  return std::nullopt;
}

// What is granted counts only when it has left: before that the server cannot know of it.
void ClientSession::grant_up_to_window() {
  const std::uint64_t outstanding_bytes = credit_bytes_ + granted_unsent_bytes_;
  const std::uint32_t step_bytes =
      options_.adaptive_window ? std::min(window_bytes_ / 4, 16U * 1024) : window_bytes_ / 4;
  if (outstanding_bytes + step_bytes > window_bytes_) return;
  const std::uint64_t bytes = window_bytes_ - outstanding_bytes;
  encode(Credit{bytes}, output_);
  granted_unsent_bytes_ += bytes;
}

// False if the server sends more than it was granted.
bool ClientSession::spend_credit(std::size_t size_bytes) {
  if (size_bytes > credit_bytes_) return false;
  credit_bytes_ -= size_bytes;
  grant_up_to_window();
  return true;
}

void ClientSession::measure_arrival(std::size_t size_bytes, TimeMs now_ms) {
  if (!options_.adaptive_window) return;
  const bool busy = wants_outstanding() || (model_ && !index_told_);
  if (!busy) return link_.pause();
  if (!link_.add(size_bytes, now_ms)) return;
  const std::uint64_t wanted = link_.bandwidth_delay_bytes() * (link_.growing() ? 2 : 1) + kSpareWindowBytes;
  const auto window = static_cast<std::uint32_t>(std::min<std::uint64_t>(wanted, options_.window_bytes));
  window_bytes_ = std::max(window, kLeastWindowBytes);
}

void ClientSession::ping(TimeMs now_ms) {
  last_ping_ms_ = now_ms;
  encode(FrameType::ping, Ping{static_cast<std::uint64_t>(now_ms)}, output_);
}

std::optional<ClientEvent> ClientSession::handle_blob(FrameType type, Bytes payload) {
  const Result<BlobPart> part = decode_blob_part(type, payload);
  if (!part) return fail_with(part.error().kind, part.error().message);
  const bool head = type == FrameType::head_data;
  if (!model_ || (head ? head_told_ : index_told_ || !head_told_)) return unexpected(type, "out of turn");
  std::vector<std::byte>& blob = head ? head_ : index_;
  const std::uint64_t size = head ? model_->head_size_bytes : model_->index_size_bytes;
  if (part->offset_bytes != blob.size() || part->bytes.empty() || part->bytes.size() > size - blob.size()) {
    return unexpected(type, "at offset " + std::to_string(part->offset_bytes) + " of " + std::to_string(size) + ", " +
                                std::to_string(blob.size()) + " was expected");
  }
  if (!spend_credit(part->bytes.size())) return unexpected(type, "beyond the credit granted");
  blob.insert(blob.end(), part->bytes.begin(), part->bytes.end());
  return completed_blob();
}

// The releases that the server had read when it sent this: what it sends from then on follows the shorter prefixes.
Result<void> ClientSession::apply_releases(FrameType type, std::uint32_t release_count) {
  const std::uint32_t read = releases_made_ - static_cast<std::uint32_t>(releases_.size());
  if (release_count < read || release_count > releases_made_) {
    return tl::unexpected<Error>(unexpected_error(type, "after " + std::to_string(release_count) +
                                                            " releases; it had read " + std::to_string(read) + " of " +
                                                            std::to_string(releases_made_)));
  }
  for (std::uint32_t i = read; i < release_count; ++i) {
    for (const CellRun& run : releases_.front()) {
      for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell) {
        sent_[cell] = std::min(sent_[cell], run.prefix);
      }
    }
    releases_.pop_front();
  }
  return {};
}

// The segment that a frame of this cell means.
Result<std::uint32_t> ClientSession::next_of(FrameType type, std::uint32_t cell) {
  const auto refuse = [&](const std::string& why) {
    return tl::unexpected<Error>(unexpected_error(type, "of cell " + std::to_string(cell) + why));
  };
  if (cell >= sent_.size()) return refuse(", the model has " + std::to_string(sent_.size()));
  if (!table_->is_known(cell)) return refuse(", before what tells of its segments");
  const std::uint32_t segment = table_->next_to_send(cell, sent_[cell]);
  if (segment >= table_->segment_count(cell)) {
    return refuse(", which has no more than its " + std::to_string(segment) + " segments");
  }
  if (segment >= wanted_[cell]) return refuse(" with segment " + std::to_string(segment) + ", which nobody wanted");
  return segment;
}

std::optional<ClientEvent> ClientSession::handle_segments(Bytes payload) {
  constexpr FrameType kType = FrameType::segments;
  const auto failed = [&](const Error& error) { return fail_with(error.kind, error.message); };
  const Result<SegmentBatch> batch = decode_segments(payload);
  if (!batch) return failed(batch.error());
  if (!model_ || set_epoch_ == 0) return unexpected(kType, "that nobody wanted");
  if (!table_) return fail_with(ErrorKind::usage, "segments came, but the session was not told the segment table");
  if (part_) return unexpected(kType, "before the segment under way was complete");
  if (!spend_credit(batch->bytes.size())) return unexpected(kType, "beyond the credit granted");
  if (const Result<void> applied = apply_releases(kType, batch->release_count); !applied)
    return failed(applied.error());
  arrived_.clear();
  next_arrived_ = next_arrived_at_ = resolved_bytes_ = 0;
  unresolved_ = batch->runs;
  unresolved_run_ = unresolved_segment_ = 0;
  arrived_bytes_.assign(batch->bytes.begin(), batch->bytes.end());
  if (const Result<void> resolved = resolve_arrived(); !resolved) {
    arrived_.clear();
    return failed(resolved.error());
  }
  return give_arrived();
}

// Finds out which segments a frame holds, as far as their cells are known: the rest when what tells of them has been
// given out, which may be in the same frame.
Result<void> ClientSession::resolve_arrived() {
  constexpr FrameType kType = FrameType::segments;
  for (; unresolved_run_ < unresolved_.size(); ++unresolved_run_, unresolved_segment_ = 0) {
    const BatchRun& run = unresolved_[unresolved_run_];
    for (; unresolved_segment_ < run.cell_count * run.segment_count; ++unresolved_segment_) {
      const std::uint32_t cell = run.first_cell + unresolved_segment_ / run.segment_count;
      if (cell < sent_.size() && !table_->is_known(cell) && next_arrived_ < arrived_.size()) return {};
      const Result<std::uint32_t> segment = next_of(kType, cell);
      if (!segment) return tl::unexpected<Error>(segment.error());
      const std::uint32_t size = table_->size_bytes(cell, *segment);
      sent_[cell] = *segment + 1;
      arrived_.push_back({cell, *segment, size});
      resolved_bytes_ += size;
    }
  }
  if (resolved_bytes_ == arrived_bytes_.size()) return {};
  return tl::unexpected<Error>(unexpected_error(kType, "of " + std::to_string(arrived_bytes_.size()) +
                                                           " bytes, by the index they have " +
                                                           std::to_string(resolved_bytes_)));
}

std::optional<ClientEvent> ClientSession::handle_segment_part(Bytes payload) {
  constexpr FrameType kType = FrameType::segment_part;
  const auto failed = [&](const Error& error) { return fail_with(error.kind, error.message); };
  const Result<SegmentPart> part = decode_segment_part(payload);
  if (!part) return failed(part.error());
  if (!model_ || set_epoch_ == 0) return unexpected(kType, "that nobody wanted");
  if (!table_) return fail_with(ErrorKind::usage, "segments came, but the session was not told the segment table");
  if (!spend_credit(part->bytes.size())) return unexpected(kType, "beyond the credit granted");
  if (part_ ? part_->cell != part->cell || part->offset_bytes != arrived_bytes_.size() : part->offset_bytes != 0) {
    return unexpected(kType, "out of order");
  }
  if (const Result<void> applied = apply_releases(kType, part->release_count); !applied) return failed(applied.error());
  if (!part_) {
    const Result<std::uint32_t> segment = next_of(kType, part->cell);
    if (!segment) return failed(segment.error());
    const std::uint32_t size_bytes = table_->size_bytes(part->cell, *segment);
    if (size_bytes <= kMaxChunkBytes) return unexpected(kType, "of a segment that fits into one frame");
    part_ = Arrived{part->cell, *segment, size_bytes};
    sent_[part->cell] = *segment + 1;
    arrived_bytes_.clear();
  }
  if (part->bytes.size() > part_->size_bytes - arrived_bytes_.size()) {
    return unexpected(kType, "beyond the segment's " + std::to_string(part_->size_bytes) + " bytes");
  }
  arrived_bytes_.insert(arrived_bytes_.end(), part->bytes.begin(), part->bytes.end());
  if (arrived_bytes_.size() < part_->size_bytes) return std::nullopt;
  arrived_ = {*part_};
  unresolved_.clear();
  unresolved_run_ = next_arrived_ = next_arrived_at_ = 0;
  part_.reset();
  return give_arrived();
}

std::optional<ClientEvent> ClientSession::give_arrived() {
  for (;;) {
    if (next_arrived_ == arrived_.size() && unresolved_run_ < unresolved_.size()) {
      if (const Result<void> resolved = resolve_arrived(); !resolved) {
        return fail_with(resolved.error().kind, resolved.error().message);
      }
    }
    if (next_arrived_ == arrived_.size()) return std::nullopt;
    const Arrived next = arrived_[next_arrived_++];
    if (next.size_bytes > arrived_bytes_.size() - next_arrived_at_) {
      return unexpected(FrameType::segments, "that are larger than their frame");
    }
    const Bytes bytes = Bytes(arrived_bytes_).subspan(next_arrived_at_, next.size_bytes);
    next_arrived_at_ += next.size_bytes;
    if (next.segment != held_prefix(next.cell)) {  // sent before the server read our release
      ++stale_segments_;
      continue;
    }
    held_[next.cell] = next.segment + 1;
    ++received_segments_;
    return event::SegmentArrived{next.cell, next.segment, bytes};
  }
}

// A segment that the newest list names and that should have come, if there is one.
std::optional<CellPrefix> ClientSession::first_missing() const {
  if (!table_) return std::nullopt;
  std::vector<std::uint32_t> released_from(released_since_list_.empty() ? 0 : held_.size(), kAllSegments);
  for (const CellRun& run : released_since_list_) {
    for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell)
      released_from[cell] = std::min(released_from[cell], run.prefix);
  }
  for (const CellRun& run : list_) {
    const std::uint64_t end = std::min<std::uint64_t>(std::uint64_t{run.first_cell} + run.cell_count, held_.size());
    for (std::uint32_t cell = run.first_cell; cell < end; ++cell) {
      if (!table_->is_known(cell)) continue;
      const std::uint32_t next = held_prefix(cell);
      if (next >= std::min(run.prefix, table_->segment_count(cell))) continue;
      if (released_from.empty() || next < released_from[cell]) return CellPrefix{cell, next};
    }
  }
  return std::nullopt;
}

std::optional<ClientEvent> ClientSession::handle_wants_done(Bytes payload) {
  const Result<WantsDone> done = decode_wants_done(payload);
  if (!done) return fail_with(done.error().kind, done.error().message);
  if (done->epoch <= served_epoch_ || done->epoch > sent_epoch_) {
    return unexpected(FrameType::wants_done, "for epoch " + std::to_string(done->epoch) + ", which is not open");
  }
  if (!index_told_) return unexpected(FrameType::wants_done, "before the index was complete");
  if (const Result<void> applied = apply_releases(FrameType::wants_done, done->release_count); !applied) {
    return fail_with(applied.error().kind, applied.error().message);
  }
  if (const std::optional<CellPrefix> missing = done->epoch == set_epoch_ ? first_missing() : std::nullopt) {
    return unexpected(FrameType::wants_done, "without having sent segment " + std::to_string(missing->prefix) +
                                                 " of cell " + std::to_string(missing->cell) + ", which was wanted");
  }
  served_epoch_ = done->epoch;
  return event::WantsServed{done->epoch};
}

std::optional<ClientEvent> ClientSession::handle_error(Bytes payload) {
  Result<ErrorMessage> error = decode_error(payload);
  if (!error) return fail_with(error.error().kind, error.error().message);
  if (error->fatal || !welcomed_) {
    return fail_with(error_kind(error->code), "the server says: " + name(error->code) + ": " + error->text);
  }
  if (opening_) {
    opening_.reset();
    have_.reset();
    wants_frame_.clear();
    early_wants_.clear();
    early_wants_many_ = false;
    list_.clear();
    set_epoch_ = served_epoch_ = sent_epoch_;  // wants sent along with this open will not be served
  } else if (error->code == ErrorCode::want_out_of_range && error->detail != 0 && error->detail <= sent_epoch_) {
    served_epoch_ = std::max(served_epoch_, error->detail);
  }
  return event::Refused{error->code, error->detail, std::move(error->text)};
}

Bytes ClientSession::pending_output() {
  if (output_sent_ == output_.size() && !wants_frame_.empty()) {
    output_.swap(wants_frame_);
    wants_frame_.clear();
    output_sent_ = 0;
    sent_epoch_ = set_epoch_;
  }
  return Bytes(output_).subspan(output_sent_);
}

void ClientSession::written(std::size_t size_bytes) {
  assert(size_bytes <= output_.size() - output_sent_);
  output_sent_ += size_bytes;
  if (output_sent_ < output_.size()) return;
  credit_bytes_ += std::exchange(granted_unsent_bytes_, 0);
  output_.clear();
  output_sent_ = 0;
}

void ClientSession::tick(TimeMs now_ms) {
  const TimeMs gap_ms = now_ms - last_tick_ms_;
  last_tick_ms_ = now_ms;
  if (gap_ms > kAwayMs) {
    last_progress_ms_ += gap_ms;
    last_received_ms_ += gap_ms;
  }
  if (std::exchange(progressed_, false)) last_progress_ms_ = now_ms;
  if (failure_ || closed_) return;
  if (!awaits_something()) last_progress_ms_ = now_ms;
  const TimeMs stalled_ms = now_ms - last_progress_ms_;
  const TimeMs silent_ms = now_ms - last_received_ms_;
  const bool dead = silent_ms > options_.ping_interval_ms + options_.stall_timeout_ms;
  if (stalled_ms > options_.stall_timeout_ms || dead) {
    failure_ = Error{ErrorKind::network, "stalled: " + std::string(silent_ms < stalled_ms ? "too little" : "nothing") +
                                             " came for " + std::to_string(std::max(stalled_ms, silent_ms) / 1000) +
                                             " s" + (dead ? "" : " while waiting for " + std::string(awaiting())) +
                                             ", " + std::to_string(received_bytes_) + " bytes were received"};
    return;
  }
  if (!welcomed_) return;
  const bool silent = silent_ms > options_.ping_interval_ms && now_ms - last_ping_ms_ > options_.ping_interval_ms;
  const bool measures = options_.adaptive_window && wants_outstanding() && now_ms - last_ping_ms_ > kMeasuringPingMs;
  if (silent || measures) ping(now_ms);
}

}  // namespace fanstream
