#include "protocol/server_session.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace fanstream {
namespace {

constexpr std::size_t kMaxUnsentBytes =
    256 * 1024;  // twice what data alone can come to, so only unread answers stop reading
constexpr std::size_t kMaxFramesInFlight = 256;

constexpr std::string_view kNotHeld = "the cells stated as held are not in the model";

}  // namespace

ServerSession::ServerSession(const ServerSessionOptions& options, TimeMs now_ms)
    : options_(options), started_ms_(now_ms), last_received_ms_(now_ms), passed_ms_(now_ms) {
  reader_.restrict_to(FrameType::hello);
}

void ServerSession::commit(std::size_t size_bytes, TimeMs now_ms) {
  pass_time(now_ms);
  reader_.commit(size_bytes);
  if (size_bytes > 0) last_received_ms_ = now_ms;
}

void ServerSession::receive(Bytes bytes, TimeMs now_ms) {
  pass_time(now_ms);
  reader_.push(bytes);
  if (!bytes.empty()) last_received_ms_ = now_ms;
}

bool ServerSession::wants_to_receive() const {
  return !closing_ && control_.size() + in_flight_bytes_ < kMaxUnsentBytes && !plan_.has_cells_to_walk();
}

// What the client says while we do not listen cannot be heard: that time is not its silence.
void ServerSession::pass_time(TimeMs now_ms) {
  if (!closing_ && !wants_to_receive()) {
    last_received_ms_ += now_ms - passed_ms_;
    if (frame_begun_ms_) *frame_begun_ms_ += now_ms - passed_ms_;
  }
  passed_ms_ = now_ms;
}

std::optional<ServerEvent> ServerSession::next_event(TimeMs now_ms) {
  pass_time(now_ms);
  input_waits_ = false;
  while (!closing_) {
    if (!wants_to_receive()) {
      input_waits_ = reader_.mid_frame();
      return std::nullopt;
    }
    const Result<std::optional<FrameView>> frame = reader_.next();
    if (!frame) {
      close(ErrorCode::bad_frame, frame.error().message);
      break;
    }
    if (!*frame) break;
    if (std::optional<ServerEvent> event = handle(**frame, now_ms)) return event;
  }
  if (closing_ || !reader_.mid_frame()) {
    frame_begun_ms_.reset();
    reader_.shrink();
  } else if (!frame_begun_ms_ || frame_begun_offset_ != reader_.offset_bytes()) {
    frame_begun_ms_ = now_ms;
    frame_begun_offset_ = reader_.offset_bytes();
  }
  return std::nullopt;
}

std::optional<ServerEvent> ServerSession::handle(const FrameView& frame, TimeMs) {
  switch (frame.type) {
    case FrameType::hello: return handle_hello(frame.payload);
    case FrameType::list:
      // One answer serves all requests that arrive before the transport has all of it: a flood of requests cannot make
      // a flood of catalogues.
      if (list_pending_) return std::nullopt;
      list_pending_ = true;
      return ListRequested{};
    case FrameType::open: return handle_open(frame.payload);
    case FrameType::wants: handle_wants(frame.payload); break;
    case FrameType::release: handle_release(frame.payload); break;
    case FrameType::credit: handle_credit(frame.payload); break;
    case FrameType::ping:
    case FrameType::pong: {
      const Result<Ping> ping = decode_ping(frame.payload);
      if (!ping) {
        close(ErrorCode::bad_message, ping.error().message);
      } else if (frame.type == FrameType::ping) {
        encode(FrameType::pong, *ping, control_);
      }
      break;
    }
    default: close(ErrorCode::unexpected_message, name(frame.type)); break;
  }
  return std::nullopt;
}

std::optional<ServerEvent> ServerSession::handle_hello(Bytes payload) {
  if (welcomed_) return close(ErrorCode::unexpected_message, "a second hello"), std::nullopt;
  const Result<Hello> hello = decode_hello(payload);
  if (!hello) return close(ErrorCode::bad_message, hello.error().message), std::nullopt;
  if (hello->version_max < kProtocolVersionMin || hello->version_min > kProtocolVersionMax) {
    const auto range = [](unsigned low, unsigned high) {
      return low == high ? std::to_string(low) : std::to_string(low) + " to " + std::to_string(high);
    };
    const std::string text = "this server speaks protocol version " + range(kProtocolVersionMin, kProtocolVersionMax) +
                             ", the client " + range(hello->version_min, hello->version_max) + "; update the " +
                             (hello->version_max < kProtocolVersionMin ? "client" : "server");
    close(ErrorCode::version_mismatch, text);
    return std::nullopt;
  }
  welcomed_ = true;
  reader_.restrict_to(std::nullopt);
  Welcome welcome;
  welcome.version = std::min(hello->version_max, kProtocolVersionMax);
  welcome.idle_timeout_ms = static_cast<std::uint32_t>(options_.idle_timeout_ms);
  encode(welcome, control_);
  return std::nullopt;
}

std::optional<ServerEvent> ServerSession::handle_open(Bytes payload) {
  Result<Open> open = decode_open(payload);
  if (!open) return close(ErrorCode::bad_message, open.error().message), std::nullopt;
  if (pending_open_ || plan_.source() != nullptr) {
    close(ErrorCode::unexpected_message, "a session serves one model; open another connection for the next");
    return std::nullopt;
  }
  open_attempted_ = true;
  have_ = std::move(open->have);
  pending_open_ = open->model;
  last_permille_ = -1;
  return OpenRequested{std::move(open->model)};
}

void ServerSession::handle_wants(Bytes payload) {
  Result<Wants> wants = decode_wants(payload);
  if (!wants) return close(ErrorCode::bad_message, wants.error().message);
  if (!open_attempted_) return close(ErrorCode::unexpected_message, "wants before any open");
  if (wants->epoch <= last_epoch_) {
    return close(ErrorCode::bad_message, "wants: epoch " + std::to_string(wants->epoch) + " after epoch " +
                                             std::to_string(last_epoch_) + ", they must grow");
  }
  last_epoch_ = wants->epoch;
  if (plan_.source() == nullptr) {
    if (pending_open_) early_wants_ = std::move(*wants);  // else: sent along with an open that has failed
    return;
  }
  take_back_unsent();
  plan_.set_wants(wants->epoch, std::move(wants->runs));
  blocked_on_credit_ = false;
}

void ServerSession::handle_release(Bytes payload) {
  Result<Release> release = decode_release(payload);
  if (!release) return close(ErrorCode::bad_message, release.error().message);
  if (!open_attempted_) return close(ErrorCode::unexpected_message, "release before any open");
  if (plan_.source() == nullptr) return;  // nothing was sent, so nothing is held
  if (!plan_.release(std::move(release->runs))) {
    refuse(ErrorCode::want_out_of_range,
           "release names cells beyond the model's " + std::to_string(plan_.source()->cell_count()));
  }
  work_through_cells();
  blocked_on_credit_ = false;
}

void ServerSession::handle_credit(Bytes payload) {
  const Result<Credit> credit = decode_credit(payload);
  if (!credit) return close(ErrorCode::bad_message, credit.error().message);
  // What is taken back unsent can lift it above the limit.
  if (credit_bytes_ > kMaxCredit || credit->bytes > kMaxCredit - credit_bytes_)
    return close(ErrorCode::limit, "more credit than 2^40 bytes");
  credit_bytes_ += credit->bytes;
  blocked_on_credit_ = false;
}

void ServerSession::send_catalogue(const std::vector<CatalogueEntry>& entries) {
  if (closing_) return;
  if (entries.size() > kMaxCatalogueEntries)
    return close(ErrorCode::limit, "the catalogue is larger than 65536 models");
  encode_catalogue(entries, control_);
  catalogue_queued_ = true;
}

void ServerSession::open_building(double fraction, TimeMs now_ms) {
  if (!pending_open_ || closing_) return;
  const int permille = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * 1000);
  if (permille / 10 == last_permille_ / 10 && last_permille_ >= 0 &&
      now_ms - last_building_ms_ < options_.building_repeat_ms) {
    return;
  }
  last_permille_ = permille;
  last_building_ms_ = now_ms;
  encode(Building{static_cast<std::uint16_t>(permille)}, control_);
}

void ServerSession::open_ready(std::shared_ptr<const SegmentSource> source) {
  if (!pending_open_ || closing_) return;
  assert(source);
  if (source->cell_count() > kMaxCells || source->head().size() > kMaxHeadBytes ||
      source->index().size() > kMaxHeadBytes) {
    return open_failed(ErrorCode::limit, "the asset is larger than the protocol can name");
  }
  const bool resumed = have_ && have_->digest == source->digest();
  if (!resumed) have_.reset();
  SendPlan plan;
  if (!plan.start(source, std::exchange(have_, std::nullopt)))
    return open_failed(ErrorCode::want_out_of_range, kNotHeld);
  plan_ = std::move(plan);
  Opened& opened = opening_.emplace();
  opened.resumed = resumed;
  opened.digest = source->digest();
  opened.cell_count = source->cell_count();
  opened.head_size_bytes = source->head().size();
  opened.index_size_bytes = source->index().size();
  opened.size_bytes = source->size_bytes();
  opened.vertex_count = source->vertex_count();
  opened.triangle_count = source->triangle_count();
  opening_model_ = std::move(*pending_open_);
  pending_open_.reset();
  work_through_cells();
}

// As far as this turn allows.
void ServerSession::work_through_cells() {
  if (plan_.work(entries_left_) && opening_) finish_open();
}

void ServerSession::finish_open() {
  Opened opened = *opening_;
  opening_.reset();
  if (!plan_.have_is_valid()) {
    plan_ = {};
    return refuse_open(ErrorCode::want_out_of_range, opening_model_, kNotHeld);
  }
  opened.segment_total = plan_.segment_total();
  encode(opened, control_);
  if (early_wants_) plan_.set_wants(early_wants_->epoch, std::move(early_wants_->runs));
  early_wants_.reset();
}

void ServerSession::open_failed(ErrorCode code, std::string_view text) {
  if (!pending_open_ || closing_) return;
  const std::string model = std::move(*pending_open_);
  pending_open_.reset();
  have_.reset();
  refuse_open(code, model, text);
}

void ServerSession::refuse_open(ErrorCode code, const std::string& model, std::string_view text) {
  early_wants_.reset();
  refuse(code, "model '" + model + "': " + std::string(text));
}

void ServerSession::refuse(ErrorCode code, std::string_view text, std::uint32_t detail) {
  if (++refusals_ > kMaxRefusals) return close(ErrorCode::limit, "too many requests that had to be refused");
  encode(ErrorMessage{code, false, detail, std::string(text)}, control_);
}

void ServerSession::close(ErrorCode code, std::string_view text) {
  if (closing_) return;
  closing_ = true;
  close_reason_ = name(code) + ": " + std::string(text);
  take_back_unsent();
  plan_.drop_wants();
  const std::uint32_t detail =
      code == ErrorCode::version_mismatch ? kProtocolVersionMin | std::uint32_t{kProtocolVersionMax} << 16 : 0;
  encode(ErrorMessage{code, true, detail, std::string(text)}, control_);
}

void ServerSession::abort(std::string reason) {
  closing_ = true;
  aborted_ = true;
  if (close_reason_.empty()) close_reason_ = std::move(reason);
}

// Un-chooses, newest first, every segment of which no byte has reached the transport.
void ServerSession::take_back_unsent() {
  std::vector<OutFrame> kept;
  while (!in_flight_.empty() && !in_flight_.back().handed && in_flight_.back().written_bytes == 0) {
    OutFrame& last = in_flight_.back();
    const std::size_t size_bytes = last.size_bytes();
    if (last.data && !plan_.take_back(*last.data)) break;
    if (last.data) credit_bytes_ += last.data->size_bytes;
    if (!last.data && !last.wants_done)
      kept.push_back(std::move(last));
    else
      in_flight_bytes_ -= size_bytes;
    in_flight_.pop_back();
  }
  for (; !kept.empty(); kept.pop_back()) in_flight_.push_back(std::move(kept.back()));
}

bool ServerSession::wants_to_send() const {
  if (aborted_) return false;
  if (!in_flight_.empty() || !control_.empty()) return true;
  return !closing_ && !blocked_on_credit_ && plan_.has_work();
}

void ServerSession::add_data(DataFrame frame) {
  OutFrame& out = in_flight_.emplace_back();
  credit_bytes_ -= frame.size_bytes;
  if (frame.type == FrameType::head_data || frame.type == FrameType::index_data) {
    out.header.emplace(frame.type, std::array{frame.offset_bytes}, frame.blob);
  } else if (frame.type == FrameType::segment_part) {
    out.header.emplace(frame.type, std::array{frame.release_count, frame.cells[0].cell, frame.offset_bytes},
                       frame.blob);
  } else if (!frame.blob.empty()) {
    const std::array<std::uint32_t, 3> fields{frame.release_count, 1, 4 * frame.cells[0].cell};  // one run of one
    out.header.emplace(frame.type, fields, frame.blob);
  } else {
    std::vector<BatchRun> runs;
    for (const ChosenSegments& chosen : frame.cells) add_to_batch(chosen.cell, chosen.count, runs);
    out.bytes.reserve(kDataContentAt + 8 + 3 * frame.cells.size() + frame.size_bytes);
    out.bytes.resize(kDataContentAt);
    WireWriter writer(out.bytes);
    write_batch_fields(frame.release_count, runs, writer);
    for (const ChosenSegments& chosen : frame.cells) {
      for (std::uint32_t segment = chosen.first, left = chosen.count; left > 0; ++segment) {
        const Bytes whole = plan_.source()->segment(chosen.cell, segment);
        writer.bytes(whole);
        left -= whole.empty() ? 0 : 1;
      }
    }
    seal_data_frame(frame.type, out.bytes);
    frame.blob = {};
  }
  out.data = std::move(frame);
  in_flight_bytes_ += out.size_bytes();
}

// Adds to in_flight_ one frame of data or what the plan has to say. False: nothing more at the moment.
bool ServerSession::choose_one() {
  DataFrame frame;
  switch (plan_.next(credit_bytes_, entries_left_, frame)) {
    case SendPlan::Next::frame: add_data(std::move(frame)); return true;
    case SendPlan::Next::wants_done: {
      OutFrame& out = in_flight_.emplace_back();
      encode(WantsDone{plan_.epoch(), plan_.release_count()}, out.bytes);
      out.wants_done = true;
      in_flight_bytes_ += out.size_bytes();
      return true;
    }
    case SendPlan::Next::no_credit: blocked_on_credit_ = true; return false;
    case SendPlan::Next::out_of_range:
      refuse(ErrorCode::want_out_of_range,
             "wants " + std::to_string(plan_.epoch()) + ": a cell beyond the model's " +
                 std::to_string(plan_.source()->cell_count()) + " cells; the rest of the list is dropped",
             plan_.epoch());
      return false;
    case SendPlan::Next::too_large: close(ErrorCode::limit, "the asset holds a segment above 64 MiB"); return false;
    case SendPlan::Next::out_of_work:
    case SendPlan::Next::idle: return false;
  }
  return false;
}

void ServerSession::fill() {
  const auto flush_control = [&] {
    if (control_.empty()) return;
    OutFrame& out = in_flight_.emplace_back();
    out.bytes.swap(control_);
    out.answers_list = std::exchange(catalogue_queued_, false);
    in_flight_bytes_ += out.size_bytes();
  };
  entries_left_ = kEntriesPerWrite;
  if (!closing_) work_through_cells();
  flush_control();
  // Frames that wait may replace the list: they come first.
  while (!closing_ && !input_waits_ && in_flight_bytes_ < options_.write_batch_bytes &&
         in_flight_.size() < kMaxFramesInFlight && choose_one()) {
  }
  flush_control();  // a refusal found while choosing
}

std::size_t ServerSession::next_write(std::span<Bytes> buffers, std::vector<std::byte>& scratch) {
  if (aborted_) return 0;
  fill();
  scratch.clear();
  scratch.reserve(in_flight_bytes_);  // so that it never moves while buffers point into it
  std::size_t count = 0;
  bool joining = false;  // the last buffer is the end of scratch
  const auto add = [&](Bytes piece) {
    if (piece.empty()) return;
    const bool join = piece.size() < kJoinBytes;
    if (join) {
      const std::byte* const at = scratch.data() + scratch.size();
      scratch.insert(scratch.end(), piece.begin(), piece.end());
      if (joining) {
        buffers[count - 1] = Bytes(buffers[count - 1].data(), buffers[count - 1].size() + piece.size());
      } else {
        buffers[count++] = Bytes(at, piece.size());
      }
    } else {
      buffers[count++] = piece;
    }
    joining = join;
  };
  for (OutFrame& frame : in_flight_) {
    if (count + 2 > buffers.size()) break;
    const Bytes front = frame.front();
    const std::size_t skip = std::min(frame.written_bytes, front.size());
    add(front.subspan(skip));
    if (frame.data) add(frame.data->blob.subspan(frame.written_bytes - skip));
    frame.handed = true;
  }
  if (count == 0) unsent_since_ms_.reset();  // it is not the client that keeps us waiting
  return count;
}

void ServerSession::written(std::size_t size_bytes, TimeMs now_ms) {
  pass_time(now_ms);
  sent_bytes_ += size_bytes;
  if (size_bytes > 0) unsent_since_ms_ = now_ms;
  assert(size_bytes <= in_flight_bytes_);
  in_flight_bytes_ -= size_bytes;
  while (!in_flight_.empty()) {
    OutFrame& frame = in_flight_.front();
    const std::size_t left = frame.size_bytes() - frame.written_bytes;
    if (size_bytes < left) {
      frame.written_bytes += size_bytes;
      break;
    }
    size_bytes -= left;
    if (frame.data) sent_segments_ += frame.data->finished_segments;
    if (frame.answers_list) list_pending_ = false;
    in_flight_.pop_front();
  }
  for (OutFrame& frame : in_flight_) frame.handed = false;
}

void ServerSession::check_sending(TimeMs now_ms) {
  if (!wants_to_send()) {
    unsent_since_ms_.reset();
  } else if (!unsent_since_ms_) {
    unsent_since_ms_ = now_ms;
  } else if (now_ms - *unsent_since_ms_ > options_.stall_timeout_ms) {
    return abort("the client takes no bytes");
  }
  if (!blocked_on_credit_) {
    no_credit_since_ms_.reset();
    if (no_credit_told_) encode(Degraded{DegradedReason::none, "sending again"}, control_);
    no_credit_told_ = false;
  } else if (!no_credit_since_ms_) {
    no_credit_since_ms_ = now_ms;
  } else if (!no_credit_told_ && now_ms - *no_credit_since_ms_ > options_.no_credit_notice_ms) {
    no_credit_told_ = true;
    encode(Degraded{DegradedReason::no_credit, "wanted data waits for credit; " + std::to_string(credit_bytes_) +
                                                   " bytes are granted, the next frame is larger"},
           control_);
  }
}

void ServerSession::tick(TimeMs now_ms) {
  if (aborted_) return;
  pass_time(now_ms);
  check_sending(now_ms);
  if (closing_) return;
  if (!welcomed_) {
    if (now_ms - started_ms_ > options_.handshake_timeout_ms)
      close(ErrorCode::handshake_timeout, "no hello arrived in time");
    return;
  }
  if (frame_begun_ms_ && now_ms - *frame_begun_ms_ > options_.frame_timeout_ms) {
    return close(ErrorCode::stalled, "a frame begun was not completed in time");
  }
  const TimeMs silent_ms = now_ms - last_received_ms_;
  if (silent_ms > options_.idle_timeout_ms) return close(ErrorCode::idle_timeout, "nothing was heard from the client");
  if (silent_ms > options_.ping_interval_ms && now_ms - last_ping_ms_ > options_.ping_interval_ms) {
    last_ping_ms_ = now_ms;
    encode(FrameType::ping, Ping{static_cast<std::uint64_t>(now_ms)}, control_);
  }
}

}  // namespace fanstream
