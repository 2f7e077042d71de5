#include "client/net/reconnecting_client.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "client/net/session_socket.h"

namespace fanstream {
namespace {

constexpr TimeMs kSliceMs = 50;  // how long a wait goes on before the stop flag is looked at

// A server that is away, restarts or is full may be there later; one that breaks the protocol will do so again.
bool may_pass(ErrorKind kind) { return kind == ErrorKind::network || kind == ErrorKind::limit; }

std::uint64_t seed_of(const ReconnectOptions& options, const void* address) {
  if (options.jitter_seed != 0) return options.jitter_seed;
  const auto ticks = static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  return ticks ^ reinterpret_cast<std::uintptr_t>(address);
}

}  // namespace

std::string text_of(const event::ConnectionLost& lost) { return "the connection was lost: " + lost.reason.message; }
std::string text_of(const event::Retrying& retrying) {
  return "connecting again, attempt " + std::to_string(retrying.attempt) + " in " + std::to_string(retrying.delay_ms) +
         " ms: " + retrying.reason;
}
std::string text_of(const event::ConnectionResumed& resumed) {
  return "connected again after " + std::to_string(resumed.attempts) +
         (resumed.attempts == 1 ? " attempt; goes on" : " attempts; goes on");
}

template <class Event>
void ReconnectingClient::report(Event event) {
  if (options_.on_notice) options_.on_notice(text_of(event));
  events_.push_back(std::move(event));
}

std::vector<CellRun> state_prefixes(std::span<const std::uint32_t> prefixes) {
  for (std::size_t group = 1;; group *= 2) {
    std::vector<CellPrefix> list;
    for (std::size_t begin = 0; begin < prefixes.size(); begin += group) {
      const std::size_t end = std::min(begin + group, prefixes.size());
      const std::uint32_t least = *std::min_element(prefixes.begin() + static_cast<std::ptrdiff_t>(begin),
                                                    prefixes.begin() + static_cast<std::ptrdiff_t>(end));
      for (std::size_t cell = begin; least > 0 && cell < end; ++cell)
        list.push_back({static_cast<std::uint32_t>(cell), least});
    }
    std::vector<CellRun> runs = to_runs(list);
    if (check_runs(runs)) return runs;
  }
}

ReconnectingClient::ReconnectingClient(const ServerAddress& address, const ReconnectOptions& options,
                                       std::optional<HeldAsset> held)
    : address_(address), options_(options), random_(seed_of(options, this)), given_(std::move(held)) {}

ReconnectingClient::~ReconnectingClient() = default;

Result<std::unique_ptr<ReconnectingClient>> ReconnectingClient::start(const ServerAddress& address,
                                                                      const ReconnectOptions& options,
                                                                      std::optional<HeldAsset> held) {
  if (address.model.empty()) return fail(ErrorKind::usage, address.text() + ": names no model");
  if (held && !held->prefixes.empty() && held->index.empty()) held->prefixes.clear();
  std::unique_ptr<ReconnectingClient> client(new ReconnectingClient(address, options, std::move(held)));
  client->progress_ms_ = steady_now_ms();
  client->attempt();
  return client;
}

std::uint32_t ReconnectingClient::held_prefix(std::uint32_t cell) const {
  return table_ ? table_->next_to_send(cell, held_[cell]) : held_[cell];
}

std::uint64_t ReconnectingClient::received_bytes() const {
  return earlier_bytes_ + (link_ ? link_->session().received_bytes() : 0);
}

// Begins a connection; what comes of it shows itself in step().
void ReconnectingClient::attempt() {
  if (link_) earlier_bytes_ += link_->session().received_bytes();
  link_ = std::make_unique<SessionSocket>(address_, options_.client.session);
  attempt_until_ms_ = steady_now_ms() + options_.client.connect_timeout_ms;
  ++connections_;
  state_ = State::connecting;
  if (const Result<void> sent = link_->session().open(address_.model, have()); !sent)
    return fail_for_good(sent.error());
  if (const Result<void> begun = link_->begin_connect(attempt_until_ms_); !begun) lost(begun.error());
}

std::optional<Have> ReconnectingClient::have() const {
  Have have;
  if (model_) {
    have.digest = model_->digest;
    have.head = head_complete_;
    have.index = head_complete_ && index_complete_;
    have.cells = state_prefixes(held_);
    return have;
  }
  if (!given_) return std::nullopt;
  have.digest = given_->digest;
  have.head = !given_->head.empty();
  have.index = have.head && !given_->index.empty();
  if (have.index) have.cells = state_prefixes(given_->prefixes);
  return have;
}

TimeMs ReconnectingClient::next_delay_ms() {
  const std::uint32_t doublings = std::min(attempts_, 20U);
  const TimeMs full_ms = std::min(options_.first_retry_ms << doublings, options_.max_retry_ms);
  return full_ms / 2 + static_cast<TimeMs>(random_() % static_cast<std::uint64_t>(full_ms / 2 + 1));
}

void ReconnectingClient::fail_for_good(Error error) {
  failure_ = std::move(error);
  if (link_) link_->close();
  state_ = State::over;
}

void ReconnectingClient::lost(Error error) {
  const bool was_open = state_ == State::streaming;
  if (link_) link_->close();
  if (!model_ || !may_pass(error.kind)) return fail_for_good(std::move(error));
  const TimeMs now_ms = steady_now_ms();
  if (was_open) {
    if (attempts_ == 0) progress_ms_ = now_ms;  // the time that is given starts with the first loss
    report(event::ConnectionLost{error});
  }
  const TimeMs delay_ms = next_delay_ms();
  if (now_ms + delay_ms - progress_ms_ > options_.give_up_after_ms) {
    return fail_for_good({ErrorKind::network, error.message + "; given up after " + std::to_string(attempts_) +
                                                  " attempts to connect again within " +
                                                  std::to_string((now_ms - progress_ms_ + 500) / 1000) +
                                                  " s without progress"});
  }
  ++attempts_;
  retry_at_ms_ = now_ms + delay_ms;
  state_ = State::waiting;
  report(event::Retrying{delay_ms, attempts_, error.message});
}

void ReconnectingClient::progressed() {
  attempts_ = 0;
  progress_ms_ = steady_now_ms();
}

// One thing without waiting; false if there was nothing to be done.
bool ReconnectingClient::step() {
  const TimeMs now_ms = steady_now_ms();
  if (state_ == State::waiting) {
    if (now_ms < retry_at_ms_) return false;
    attempt();
    return true;
  }
  if (state_ == State::connecting) {
    const Result<bool> connected = link_->connected();
    if (!connected) return lost(connected.error()), true;
    if (*connected) state_ = State::greeting;
  }
  if (state_ == State::connecting || state_ == State::greeting) {
    if (now_ms > attempt_until_ms_) {
      lost(link_->located(
          {ErrorKind::network, "no welcome within " + std::to_string(options_.client.connect_timeout_ms) + " ms"}));
      return true;
    }
    if (state_ == State::connecting) return false;
  }
  ClientSession& session = link_->session();
  if (std::optional<ClientEvent> event = session.next_event()) return take(*event), true;
  if (!link_->ended() && link_->move_bytes()) return true;
  session.tick(now_ms);
  return session.failed();
}

void ReconnectingClient::take(ClientEvent& event) {
  ClientSession& session = link_->session();
  if (auto* failed = std::get_if<event::Failed>(&event)) return lost(link_->located(std::move(failed->error)));
  if (std::holds_alternative<event::Welcomed>(event)) {
    state_ = State::opening;  // which was asked for along with the greeting
  } else if (auto* building = std::get_if<event::BuildingModel>(&event)) {
    events_.push_back(*building);
  } else if (const auto* opened = std::get_if<event::ModelOpened>(&event)) {
    take_opened(opened->model);
  } else if (std::holds_alternative<event::HeadComplete>(event)) {
    if (head_complete_) return;
    head_.assign(session.head().begin(), session.head().end());
    head_complete_ = true;
    progressed();
    events_.push_back(event::HeadComplete{});
  } else if (std::holds_alternative<event::IndexComplete>(event)) {
    if (index_complete_) return;
    index_.assign(session.index().begin(), session.index().end());
    index_complete_ = true;
    progressed();
    events_.push_back(event::IndexComplete{});
  } else if (const auto* segment = std::get_if<event::SegmentArrived>(&event)) {
    if (take_segment(*segment)) events_.push_back(*segment);
  } else if (const auto* served = std::get_if<event::WantsServed>(&event)) {
    if (served->epoch != session_epoch_) return;  // of a list that has been replaced
    progressed();
    served_epoch_ = epoch_;
    events_.push_back(event::WantsServed{epoch_});
  } else if (auto* refused = std::get_if<event::Refused>(&event)) {
    if (state_ == State::opening) {
      return lost(link_->located({error_kind(refused->code), "the server says: " + refused->text}));
    }
    if (!session.wants_outstanding()) served_epoch_ = epoch_;
    events_.push_back(*refused);
  } else if (auto* degraded = std::get_if<event::ServerDegraded>(&event)) {
    events_.push_back(std::move(*degraded));
  }
}

// False if it is held already: a statement of very many prefixes is rounded down.
bool ReconnectingClient::take_segment(const event::SegmentArrived& segment) {
  if (segment.segment < held_[segment.cell]) return false;
  held_[segment.cell] = segment.segment + 1;
  progressed();
  return true;
}

void ReconnectingClient::take_opened(const Opened& opened) {
  if (model_) {
    if (opened.digest != model_->digest) {
      return fail_for_good(
          link_->located({ErrorKind::bad_input, "model '" + address_.model +
                                                    "' was replaced by another while the connection was "
                                                    "lost; what was received is of the old one, open it again"}));
    }
    if (!opened.resumed || opened.cell_count != model_->cell_count) {
      return fail_for_good(link_->located({ErrorKind::bad_input,
                                           "the server does not go on where it was, although "
                                           "it has the same asset"}));
    }
    report(event::ConnectionResumed{attempts_});
  } else {
    model_ = opened;
    held_.assign(opened.cell_count, 0);
    if (opened.resumed && given_) {
      head_ = std::move(given_->head);
      index_ = std::move(given_->index);
      head_complete_ = !head_.empty();
      index_complete_ = head_complete_ && !index_.empty();
      if (index_complete_ && given_->prefixes.size() == held_.size()) held_ = std::move(given_->prefixes);
    }
    given_.reset();
    events_.push_back(event::ModelOpened{opened});
    if (head_complete_) events_.push_back(event::HeadComplete{});
    if (index_complete_) events_.push_back(event::IndexComplete{});
    progressed();
  }
  state_ = State::streaming;
  if (opened.resumed && !release_what_was_dropped()) return;
  tell_wants();
}

// What was stated as held when this connection began, and has been dropped before it was opened. False: it is over.
bool ReconnectingClient::release_what_was_dropped() {
  ClientSession& session = link_->session();
  std::vector<CellPrefix> dropped;
  for (std::uint32_t cell = 0; cell < held_.size(); ++cell) {
    if (session.held_prefix(cell) > held_[cell]) dropped.push_back({cell, held_[cell]});
  }
  const Result<void> told = session.release(to_runs(dropped));
  if (!told) fail_for_good(link_->located(told.error()));
  return told.has_value();
}

// The list as it is, to a connection that knows the segments. Until then nothing of it could be taken.
void ReconnectingClient::tell_wants() {
  if (state_ != State::streaming || !table_) return;
  ClientSession& session = link_->session();
  if (const Result<void> set = session.set_segment_table(table_); !set) {
    return fail_for_good(link_->located(set.error()));
  }
  if (!wants_) return;
  const Result<std::uint32_t> epoch = session.set_wants(*wants_);
  if (!epoch) return fail_for_good(link_->located(epoch.error()));
  session_epoch_ = *epoch;
}

std::optional<ReconnectingEvent> ReconnectingClient::pop() {
  if (events_.empty()) return std::nullopt;
  ReconnectingEvent event = std::move(events_.front());
  events_.pop_front();
  return event;
}

Result<std::optional<ReconnectingEvent>> ReconnectingClient::next_event(TimeMs timeout_ms) {
  const TimeMs deadline_ms = steady_now_ms() + timeout_ms;
  for (;;) {
    if (std::optional<ReconnectingEvent> event = pop()) return event;
    if (failure_) return tl::unexpected<Error>(*failure_);
    const std::atomic<bool>* const stop = options_.client.stop;
    if (stop != nullptr && stop->load(std::memory_order_relaxed)) {
      fail_for_good({ErrorKind::interrupted, address_.text() + ": stopped by the user"});
      continue;
    }
    if (step()) continue;
    const TimeMs left_ms = deadline_ms - steady_now_ms();
    if (left_ms <= 0) return std::optional<ReconnectingEvent>();
    const TimeMs wait_ms = std::min(left_ms, kSliceMs);
    if (state_ == State::waiting) {
      std::this_thread::sleep_for(
          std::chrono::milliseconds(std::clamp<TimeMs>(retry_at_ms_ - steady_now_ms(), 1, wait_ms)));
    } else {
      link_->wait(wait_ms);
    }
  }
}

template <class Done>
Result<void> ReconnectingClient::await(Done done, const std::function<void(double)>& on_building) {
  std::deque<ReconnectingEvent> kept;
  Result<void> outcome;
  while (!done()) {
    Result<std::optional<ReconnectingEvent>> event = next_event(1'000);
    if (!event) {
      outcome = tl::unexpected<Error>(event.error());
      break;
    }
    if (!*event) continue;
    if (const auto* building = std::get_if<event::BuildingModel>(&**event)) {
      if (on_building) on_building(building->fraction);
    } else {
      kept.push_back(std::move(**event));
    }
  }
  events_.insert(events_.begin(), kept.begin(), kept.end());
  return outcome;
}

Result<Opened> ReconnectingClient::wait_until_opened(const std::function<void(double)>& on_building) {
  if (Result<void> opened = await([this] { return model_.has_value(); }, on_building); !opened) {
    return tl::unexpected<Error>(opened.error());
  }
  return *model_;
}

Result<Bytes> ReconnectingClient::receive_head() {
  if (Result<void> came = await([this] { return head_complete_; }); !came) return tl::unexpected<Error>(came.error());
  return head();
}

Result<Bytes> ReconnectingClient::receive_index() {
  if (Result<void> came = await([this] { return index_complete_; }); !came) return tl::unexpected<Error>(came.error());
  return index();
}

Result<void> ReconnectingClient::set_segment_table(std::shared_ptr<const SegmentTable> table) {
  if (!index_complete_) return fail(ErrorKind::usage, name() + ": the index has not been received");
  if (table->cell_count() != held_.size() || table->segment_total() != model_->segment_total) {
    return fail(ErrorKind::bad_input, name() + ": the index has " + std::to_string(table->cell_count()) +
                                          " cells, the server said " + std::to_string(held_.size()));
  }
  table_ = std::move(table);
  for (std::uint32_t cell = 0; cell < held_.size(); ++cell) {
    held_[cell] = std::min(held_[cell], table_->segment_count(cell));
  }
  tell_wants();
  return {};
}

Result<std::uint32_t> ReconnectingClient::set_wants(std::vector<CellRun> runs) {
  if (!table_) return fail(ErrorKind::usage, name() + ": wants need the segment table");
  if (Result<void> valid = check_runs(runs); !valid) return tl::unexpected<Error>(with_context(valid.error(), name()));
  wants_ = std::move(runs);
  ++epoch_;
  if (state_ == State::streaming) {
    const Result<std::uint32_t> epoch = link_->session().set_wants(*wants_);
    if (!epoch) return tl::unexpected<Error>(link_->located(epoch.error()));
    session_epoch_ = *epoch;
  }
  return epoch_;
}

Result<void> ReconnectingClient::release(const std::vector<CellRun>& runs) {
  if (!model_) return fail(ErrorKind::usage, name() + ": release needs an open model");
  if (Result<void> valid = check_each_run(runs); !valid)
    return tl::unexpected<Error>(with_context(valid.error(), name()));
  for (const CellRun& run : runs) {
    if (std::uint64_t{run.first_cell} + run.cell_count > held_.size()) {
      return fail(ErrorKind::usage,
                  name() + ": release names a cell beyond the model's " + std::to_string(held_.size()));
    }
  }
  if (state_ == State::streaming) {
    if (Result<void> told = link_->session().release(runs); !told) return told;
  }
  for (const CellRun& run : runs) {
    for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell)
      held_[cell] = std::min(held_[cell], run.prefix);
  }
  return {};
}

}  // namespace fanstream
