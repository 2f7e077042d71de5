#include "client/model/segment_stream.h"

#include <algorithm>
#include <cstring>

#include "client/model/source_place.h"
#include "common/asset/asset_file.h"

namespace fanstream {
namespace {

using Next = std::optional<StreamEvent>;

// A list of wants, walked as far as segments are at hand.
class WantWalk {
 public:
  void set(std::vector<CellRun> runs) {
    runs_ = std::move(runs);
    run_ = cell_ = 0;
  }
  // The next wanted segment of which `at_hand(cell, segment)` holds; `given` is what was given out of each cell.
  template <class AtHand>
  std::optional<CellPrefix> next(const SegmentTable& table, const std::vector<std::uint32_t>& given, AtHand at_hand) {
    for (; run_ < runs_.size(); ++run_, cell_ = 0) {
      const CellRun& run = runs_[run_];
      for (; cell_ < run.cell_count; ++cell_) {
        const std::uint32_t cell = run.first_cell + cell_;
        const std::uint32_t segment = table.next_to_send(cell, given[cell]);
        if (segment < std::min(run.prefix, table.segment_count(cell)) && at_hand(cell, segment))
          return CellPrefix{cell, segment};
      }
    }
    return std::nullopt;
  }

 private:
  std::vector<CellRun> runs_;
  std::size_t run_ = 0;
  std::uint32_t cell_ = 0;
};

Result<void> check_cells(const std::vector<CellRun>& runs, const SegmentTable* table, const std::string& name) {
  if (table == nullptr) return fail(ErrorKind::usage, name + ": cells are named before the index was read");
  if (Result<void> valid = check_each_run(runs); !valid)
    return tl::unexpected<Error>(with_context(valid.error(), name));
  for (const CellRun& run : runs) {
    if (std::uint64_t{run.first_cell} + run.cell_count <= table->cell_count()) continue;
    return fail(ErrorKind::usage, name + ": cell " + std::to_string(run.first_cell + run.cell_count - 1) +
                                      " is named, the model has " + std::to_string(table->cell_count()));
  }
  return {};
}

// Of wants, which are one list.
Result<void> check_list(const std::vector<CellRun>& runs, const SegmentTable* table, const std::string& name) {
  if (Result<void> valid = check_runs(runs); !valid) return tl::unexpected<Error>(with_context(valid.error(), name));
  return check_cells(runs, table, name);
}

void lower(const std::vector<CellRun>& runs, std::vector<std::uint32_t>& prefixes) {
  for (const CellRun& run : runs) {
    for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell)
      prefixes[cell] = std::min(prefixes[cell], run.prefix);
  }
}

class FileStream final : public SegmentStream {
 public:
  FileStream(std::shared_ptr<const AssetFile> asset, const std::filesystem::path& path, const std::atomic<bool>* stop)
      : asset_(std::move(asset)), name_(path.string()), model_(path.stem().string()), stop_(stop) {}

  const std::string& name() const override { return name_; }
  std::string model() const override { return model_; }
  Digest digest() const override { return asset_->digest(); }
  Result<std::span<const std::byte>> head() override {
    received_bytes_ += asset_->head().size();
    return asset_->head();
  }
  Result<std::span<const std::byte>> index() override {
    received_bytes_ += asset_->index().size();
    return asset_->index();
  }
  Result<void> use_index(const AssetIndex& index) override {
    table_ = segment_table(index);
    given_.assign(table_->cell_count(), 0);
    return {};
  }
  void learn_children(const AssetIndex& index, std::uint32_t parent) override {
    fanstream::learn_children(index, parent, *table_);
  }
  Result<std::uint32_t> want(std::vector<CellRun> runs) override {
    if (Result<void> valid = check_list(runs, table_.get(), name_); !valid) return tl::unexpected(valid.error());
    walk_.set(std::move(runs));
    outstanding_ = true;
    return ++epoch_;
  }
  Result<void> release(const std::vector<CellRun>& runs) override {
    if (Result<void> valid = check_cells(runs, table_.get(), name_); !valid) return valid;
    lower(runs, given_);
    return {};
  }
  Result<Next> next_event(TimeMs) override {
    if (stop_ != nullptr && *stop_) return fail(ErrorKind::interrupted, name_ + ": stopped by the user");
    if (!outstanding_) return Next();
    const auto next = walk_.next(*table_, given_, [](std::uint32_t, std::uint32_t) { return true; });
    if (!next) {
      outstanding_ = false;
      return Next(event::WantsServed{epoch_});
    }
    given_[next->cell] = next->prefix + 1;
    const std::span<const std::byte> bytes = asset_->segment(next->cell, next->prefix);
    received_bytes_ += bytes.size();
    return Next(event::SegmentArrived{next->cell, next->prefix, bytes});
  }
  std::uint32_t held_prefix(std::uint32_t cell) const override { return table_->next_to_send(cell, given_[cell]); }
  bool wants_outstanding() const override { return outstanding_; }
  std::uint64_t received_bytes() const override { return received_bytes_; }

 private:
  std::shared_ptr<const AssetFile> asset_;
  std::string name_;
  std::string model_;
  const std::atomic<bool>* stop_;
  std::shared_ptr<SegmentTable> table_;
  std::vector<std::uint32_t> given_;
  WantWalk walk_;
  bool outstanding_ = false;
  std::uint32_t epoch_ = 0;
  std::uint64_t received_bytes_ = 0;
};

// What the server has given is in the cache as well (while there is one), so that what is released comes from there
// when it is wanted again, and the server need not know of the release.
class ServerStream final : public SegmentStream {
 public:
  ServerStream(const ServerAddress& address, const SegmentStreamOptions& options)
      : address_(address), options_(options), name_(address.text() + "/" + address.model) {}
  Result<void> open();

  const std::string& name() const override { return name_; }
  std::string model() const override { return address_.model; }
  Digest digest() const override { return client_->model()->digest; }
  Result<std::span<const std::byte>> head() override;
  Result<std::span<const std::byte>> index() override;
  Result<void> use_index(const AssetIndex& index) override;
  void learn_children(const AssetIndex& index, std::uint32_t parent) override {
    fanstream::learn_children(index, parent, *table_);
  }
  Result<std::uint32_t> want(std::vector<CellRun> runs) override;
  Result<void> release(const std::vector<CellRun>& runs) override;
  Result<Next> next_event(TimeMs timeout_ms) override;
  std::uint32_t held_prefix(std::uint32_t cell) const override { return table_->next_to_send(cell, given_[cell]); }
  bool wants_outstanding() const override { return client_->wants_outstanding() || cache_is_behind_; }
  std::uint64_t received_bytes() const override { return earlier_bytes_ + client_->received_bytes(); }
  std::uint64_t cached_bytes() const override { return cached_bytes_; }

 private:
  Result<void> connect(std::optional<HeldAsset> held);
  std::optional<HeldAsset> cached_asset(const Digest& digest);
  // What the cache says to what it is asked to keep.
  template <class T>
  void keep(const Result<T>& kept) {
    if (!kept) cache_off(kept.error());
  }
  void cache_off(const Error& why);
  Result<void> release_what_only_the_cache_had();
  Result<void> fetch_again(std::uint32_t cell, std::uint32_t segment);
  Result<std::optional<StreamEvent>> next_cached();
  std::optional<StreamEvent> take(ReconnectingEvent& event);

  ServerAddress address_;
  SegmentStreamOptions options_;
  std::string name_;
  std::unique_ptr<ReconnectingClient> client_;
  std::unique_ptr<SegmentCache> cache_;
  std::optional<std::string> cache_off_reason_;
  bool head_cached_ = false, index_cached_ = false;
  std::shared_ptr<SegmentTable> table_;
  std::vector<std::uint32_t> given_;
  WantWalk walk_;
  std::optional<std::vector<CellRun>> wants_;
  std::uint32_t epoch_ = 0;
  bool cache_is_behind_ = false;  // walk_ has not been looked through
  std::uint64_t earlier_bytes_ = 0, cached_bytes_ = 0;
};

void ServerStream::cache_off(const Error& why) {
  cache_.reset();
  cache_off_reason_ = why.message;
}

// Head, index and prefixes as they can be stated to the server; nothing if the cache has none of it.
std::optional<HeldAsset> ServerStream::cached_asset(const Digest& digest) {
  std::optional<std::vector<std::byte>> head = cache_->head(), index = cache_->index();
  if (!head) return std::nullopt;
  const Result<AssetPreamble> preamble = read_preamble(*head, name_);
  const Result<AssetHead> asset_head = read_head(*head, name_);
  if (!preamble || preamble->digest != digest || !asset_head) return std::nullopt;
  HeldAsset held{preamble->digest, std::move(*head), {}, {}};
  if (!index) return held;
  Result<AssetIndex> asset_index = read_index(*index, *preamble, *asset_head, name_);
  if (!asset_index) return held;
  held.index = std::move(*index);
  const std::shared_ptr<SegmentTable> table = segment_table(*asset_index);
  for (std::uint32_t cell = 0; cell < table->cell_count(); ++cell) {
    std::uint32_t segment = table->is_known(cell) ? table->next_to_send(cell, 0) : 0;
    while (table->is_known(cell) && segment < table->segment_count(cell) && cache_->holds(cell, segment)) {
      const bool page = asset_index->is_page(cell, segment);
      const auto bytes = page ? cache_->read(cell, segment) : std::nullopt;
      if (page && (!bytes || !read_page(*bytes, cell, *asset_head, *asset_index, name_))) break;
      if (page) fanstream::learn_children(*asset_index, cell, *table);
      segment = table->next_to_send(cell, segment + 1);
    }
    held.prefixes.push_back(segment);
  }
  return held;
}

Result<void> ServerStream::connect(std::optional<HeldAsset> held) {
  if (client_) earlier_bytes_ += client_->received_bytes();
  auto client = ReconnectingClient::start(address_, options_.network, std::move(held));
  if (!client) return tl::unexpected<Error>(client.error());
  client_ = std::move(*client);
  const Result<Opened> opened = client_->wait_until_opened(options_.on_building);
  if (opened) return {};
  Error error = opened.error();
  if (error.kind == ErrorKind::not_found) error.message += "; see fanstream-client list " + address_.text();
  return tl::unexpected<Error>(std::move(error));
}

Result<void> ServerStream::open() {
  std::optional<HeldAsset> held;
  std::optional<Digest> recalled;
  if (!options_.cache_folder.empty()) {
    auto cache = SegmentCache::open(options_.cache_folder, options_.cache_limit_bytes);
    if (cache) {
      cache_ = std::move(*cache);
      recalled = cache_->recall(name_);
    } else {
      cache_off(cache.error());
    }
  }
  if (recalled) {
    if (const Result<void> begun = cache_->begin(*recalled); begun) {
      held = cached_asset(*recalled);
    } else {
      cache_off(begun.error());
    }
  }
  const bool stated = held.has_value();
  if (Result<void> connected = connect(std::move(held)); !connected) return connected;
  if (!cache_ || (stated && client_->model()->resumed)) return {};
  // Another asset than when it was last streamed, or the first time from this source; the cache may have it all the
  // same.
  const Digest digest = client_->model()->digest;
  if (const Result<void> begun = cache_->begin(digest); !begun) return cache_off(begun.error()), Result<void>();
  if (const Result<void> remembered = cache_->remember(name_, digest); !remembered) {
    return cache_off(remembered.error()), Result<void>();
  }
  held = cached_asset(digest);
  if (!held) return {};
  if (Result<void> connected = connect(std::move(held)); !connected) return connected;
  if (!client_->model()->resumed) cache_off({ErrorKind::bad_input, name_ + ": the model was replaced meanwhile"});
  return {};
}

Result<std::span<const std::byte>> ServerStream::head() {
  const Result<Bytes> bytes = client_->receive_head();
  if (bytes && cache_ && !std::exchange(head_cached_, true) && !cache_->head()) keep(cache_->put_head(*bytes));
  return bytes;
}

Result<std::span<const std::byte>> ServerStream::index() {
  const Result<Bytes> bytes = client_->receive_index();
  if (bytes && cache_ && !std::exchange(index_cached_, true) && !cache_->index()) keep(cache_->put_index(*bytes));
  return bytes;
}

Result<void> ServerStream::use_index(const AssetIndex& index) {
  table_ = segment_table(index);
  given_.assign(table_->cell_count(), 0);
  return client_->set_segment_table(table_);
}

Result<std::uint32_t> ServerStream::want(std::vector<CellRun> runs) {
  if (Result<void> valid = check_list(runs, table_.get(), name_); !valid) return tl::unexpected(valid.error());
  wants_ = runs;
  walk_.set(runs);
  cache_is_behind_ = cache_ != nullptr;
  if (const Result<std::uint32_t> set = client_->set_wants(std::move(runs)); !set) return set;
  return ++epoch_;
}

// To the server only what the cache has not.
Result<void> ServerStream::release(const std::vector<CellRun>& runs) {
  if (Result<void> valid = check_cells(runs, table_.get(), name_); !valid) return valid;
  lower(runs, given_);
  if (!cache_) return client_->release(runs);
  std::vector<CellPrefix> dropped;
  for (const CellRun& run : runs) {
    for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell) {
      const std::uint32_t held = client_->held_prefix(cell);
      std::uint32_t segment = table_->next_to_send(cell, run.prefix);
      while (segment < held && cache_->holds(cell, segment)) segment = table_->next_to_send(cell, segment + 1);
      if (segment < held) dropped.push_back({cell, segment});
    }
  }
  return dropped.empty() ? Result<void>() : client_->release(to_runs(dropped));
}

// Without the cache it has to come from the server again.
Result<void> ServerStream::release_what_only_the_cache_had() {
  cache_is_behind_ = false;
  std::vector<CellPrefix> dropped;
  for (std::uint32_t cell = 0; cell < given_.size(); ++cell) {
    if (held_prefix(cell) < client_->held_prefix(cell)) dropped.push_back({cell, given_[cell]});
  }
  if (dropped.empty()) return {};
  if (Result<void> released = client_->release(to_runs(dropped)); !released) return released;
  if (!wants_) return {};
  if (const Result<std::uint32_t> set = client_->set_wants(*wants_); !set) return tl::unexpected<Error>(set.error());
  return {};
}

// The cache has lost a segment that the server counts as held.
Result<void> ServerStream::fetch_again(std::uint32_t cell, std::uint32_t segment) {
  if (Result<void> released = client_->release({{cell, 1, segment}}); !released) return released;
  if (const Result<std::uint32_t> set = client_->set_wants(*wants_); !set) return tl::unexpected<Error>(set.error());
  return {};
}

Result<std::optional<StreamEvent>> ServerStream::next_cached() {
  const auto held_by_client = [&](std::uint32_t cell, std::uint32_t segment) {
    return segment < client_->held_prefix(cell);
  };
  while (const auto next = walk_.next(*table_, given_, held_by_client)) {
    const auto bytes = cache_ ? cache_->read(next->cell, next->prefix) : std::nullopt;
    if (bytes && bytes->size() == table_->size_bytes(next->cell, next->prefix)) {
      given_[next->cell] = next->prefix + 1;
      cached_bytes_ += bytes->size();
      return Next(event::SegmentArrived{next->cell, next->prefix, *bytes});
    }
    if (Result<void> again = fetch_again(next->cell, next->prefix); !again) return tl::unexpected(again.error());
  }
  cache_is_behind_ = false;
  return Next();
}

std::optional<StreamEvent> ServerStream::take(ReconnectingEvent& event) {
  if (const auto* arrived = std::get_if<event::SegmentArrived>(&event)) {
    const bool next = table_->next_to_send(arrived->cell, given_[arrived->cell]) == arrived->segment;
    if (cache_) keep(cache_->append(arrived->cell, arrived->segment, arrived->bytes));
    if (!next) return std::nullopt;  // released while it was under way; it comes from the cache when it is wanted
    given_[arrived->cell] = arrived->segment + 1;
    return *arrived;
  }
  if (std::holds_alternative<event::WantsServed>(event)) {
    if (cache_) keep(cache_->flush());
    return event::WantsServed{epoch_};
  }
  if (const auto* degraded = std::get_if<event::ServerDegraded>(&event)) return *degraded;
  if (const auto* lost = std::get_if<event::ConnectionLost>(&event)) return *lost;
  if (const auto* retrying = std::get_if<event::Retrying>(&event)) return *retrying;
  if (const auto* resumed = std::get_if<event::ConnectionResumed>(&event)) return *resumed;
  return std::nullopt;
}

Result<Next> ServerStream::next_event(TimeMs timeout_ms) {
  const TimeMs deadline_ms = steady_now_ms() + timeout_ms;
  for (;;) {
    if (cache_off_reason_) {
      if (Result<void> released = release_what_only_the_cache_had(); !released) return tl::unexpected(released.error());
      return Next(event::CacheOff{*std::exchange(cache_off_reason_, std::nullopt)});
    }
    if (cache_is_behind_) {
      Result<Next> cached = next_cached();
      if (!cached || *cached) return cached;
    }
    Result<std::optional<ReconnectingEvent>> event =
        client_->next_event(std::max<TimeMs>(0, deadline_ms - steady_now_ms()));
    if (!event) return tl::unexpected<Error>(event.error());
    if (!*event) return Next();
    if (const auto* refused = std::get_if<event::Refused>(&**event)) {
      return fail(error_kind(refused->code), name_ + ": the server says: " + refused->text);
    }
    if (Next taken = take(**event)) return taken;
  }
}

}  // namespace

Result<std::unique_ptr<SegmentStream>> SegmentStream::open(const std::string& text,
                                                           const SegmentStreamOptions& options) {
  const Result<SourcePlace> place = locate_source(text);
  if (!place) return tl::unexpected<Error>(place.error());
  if (place->server) {
    auto stream = std::make_unique<ServerStream>(*place->server, options);
    if (Result<void> opened = stream->open(); !opened) return tl::unexpected<Error>(opened.error());
    return stream;
  }
  Result<std::shared_ptr<const AssetFile>> asset = AssetFile::open(text);
  if (!asset) return tl::unexpected<Error>(asset.error());
  return std::make_unique<FileStream>(std::move(*asset), text, options.network.client.stop);
}

}  // namespace fanstream
