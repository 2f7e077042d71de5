#include "client/model/model_source.h"

#include <filesystem>

#include "client/model/source_place.h"
#include "common/asset/asset_file.h"

namespace fanstream {
namespace {

namespace fs = std::filesystem;
constexpr TimeMs kWaitMs = 1'000;  // the session's own timeouts end a wait for good

class FileSource final : public ModelSource {
 public:
  FileSource(std::shared_ptr<const AssetFile> asset, fs::path path, const std::atomic<bool>* stop)
      : asset_(std::move(asset)), name_(path.string()), model_(path.stem().string()), stop_(stop) {}

  const std::string& name() const override { return name_; }
  std::string model() const override { return model_; }
  std::uint64_t head_size_bytes() const override { return asset_->head().size(); }
  std::uint64_t index_size_bytes() const override { return asset_->index().size(); }
  Digest digest() const override { return asset_->digest(); }
  Result<std::span<const std::byte>> head() override {
    received_bytes_ += asset_->head().size();
    return asset_->head();
  }
  Result<std::span<const std::byte>> index() override {
    received_bytes_ += asset_->index().size();
    return asset_->index();
  }
  Result<void> use_index(const AssetIndex&) override { return {}; }
  void learn_children(const AssetIndex&, std::uint32_t) override {}
  Result<void> want(const std::vector<OrderedSegment>& order, std::size_t end) override {
    order_ = &order;
    end_ = std::min(end, order.size());
    return {};
  }
  Result<std::optional<std::span<const std::byte>>> next_segment() override {
    using Next = std::optional<std::span<const std::byte>>;
    if (stop_ != nullptr && *stop_) return fail(ErrorKind::interrupted, name_ + ": stopped by the user");
    if (next_ == end_) return Next();
    const OrderedSegment& wanted = (*order_)[next_++];
    received_bytes_ += wanted.size_bytes;
    return Next(asset_->segment(wanted.cell, wanted.segment));
  }
  std::uint64_t received_bytes() const override { return received_bytes_; }
  std::uint64_t cost_bytes(std::uint64_t, std::uint64_t bytes) const override { return bytes; }
  std::uint64_t slack_bytes() const override { return 0; }

 private:
  std::shared_ptr<const AssetFile> asset_;
  std::string name_;
  std::string model_;
  const std::atomic<bool>* stop_;
  const std::vector<OrderedSegment>* order_ = nullptr;
  std::size_t next_ = 0;
  std::size_t end_ = 0;
  std::uint64_t received_bytes_ = 0;
};

class ServerSource final : public ModelSource {
 public:
  ServerSource(StreamClient client, Opened opened, std::string model)
      : client_(std::move(client)),
        opened_(std::move(opened)),
        name_(client_.server_text() + "/" + model),
        model_(std::move(model)) {}

  const std::string& name() const override { return name_; }
  std::string model() const override { return model_; }
  std::uint64_t head_size_bytes() const override { return opened_.head_size_bytes; }
  std::uint64_t index_size_bytes() const override { return opened_.index_size_bytes; }
  Digest digest() const override { return opened_.digest; }
  Result<std::span<const std::byte>> head() override { return client_.receive_head(); }
  Result<std::span<const std::byte>> index() override { return client_.receive_index(); }
  Result<void> use_index(const AssetIndex& index) override {
    table_ = segment_table(index);
    return client_.set_segment_table(table_);
  }
  void learn_children(const AssetIndex& index, std::uint32_t parent) override {
    fanstream::learn_children(index, parent, *table_);
  }
  Result<void> want(const std::vector<OrderedSegment>& order, std::size_t end) override;
  Result<std::optional<std::span<const std::byte>>> next_segment() override;
  std::uint64_t received_bytes() const override { return client_.session().received_bytes(); }
  std::uint64_t cost_bytes(std::uint64_t segments, std::uint64_t bytes) const override;
  std::uint64_t slack_bytes() const override { return 64; }

 private:
  StreamClient client_;
  Opened opened_;
  std::string name_;
  std::string model_;
  std::shared_ptr<SegmentTable> table_;
  const std::vector<OrderedSegment>* order_ = nullptr;
  std::size_t next_ = 0;
  std::size_t end_ = 0;
};

Result<void> ServerSource::want(const std::vector<OrderedSegment>& order, std::size_t end) {
  order_ = &order;
  end_ = std::min(end, order.size());
  if (next_ == end_) return {};
  if (const Result<std::uint32_t> sent = client_.set_wants(wants_for(order, end_)); !sent) {
    return tl::unexpected(with_context(sent.error(), name_));
  }
  return {};
}

Result<std::optional<std::span<const std::byte>>> ServerSource::next_segment() {
  using Next = std::optional<std::span<const std::byte>>;
  while (next_ < end_) {
    if ((*order_)[next_].size_bytes == 0) {  // never sent
      ++next_;
      return Next(std::span<const std::byte>());
    }
    Result<std::optional<ClientEvent>> event = client_.next_event(kWaitMs);
    if (!event) return tl::unexpected(event.error());
    if (!*event) continue;
    if (const auto* refused = std::get_if<event::Refused>(&**event)) {
      return fail(error_kind(refused->code), name_ + ": the server says: " + refused->text);
    }
    const auto* arrived = std::get_if<event::SegmentArrived>(&**event);
    if (arrived == nullptr) continue;
    const OrderedSegment& wanted = (*order_)[next_];
    if (arrived->cell != wanted.cell || arrived->segment != wanted.segment) {
      return fail(ErrorKind::bad_input, name_ + ": the server sent cell " + std::to_string(arrived->cell) +
                                            " segment " + std::to_string(arrived->segment) + " instead of cell " +
                                            std::to_string(wanted.cell) + " segment " + std::to_string(wanted.segment));
    }
    ++next_;
    return Next(arrived->bytes);
  }
  return Next();
}

// At worst every second cell has no such segment, and each starts a run of its own; and frames are half full.
std::uint64_t ServerSource::cost_bytes(std::uint64_t segments, std::uint64_t bytes) const {
  return bytes + 2 * segments + bytes / 128;
}

Result<std::unique_ptr<ModelSource>> open_on_server(const ServerAddress& address, const SourceOptions& options) {
  Result<StreamClient> client = StreamClient::connect(address, options.client);
  if (!client) return tl::unexpected(client.error());
  Result<Opened> opened = client->open(address.model, options.on_building);
  if (!opened) {
    Error error = opened.error();
    if (error.kind == ErrorKind::not_found) error.message += "; see fanstream-client list " + address.text();
    return tl::unexpected(std::move(error));
  }
  return std::make_unique<ServerSource>(std::move(*client), std::move(*opened), address.model);
}

}  // namespace

Result<std::unique_ptr<ModelSource>> ModelSource::open(const std::string& text, const SourceOptions& options) {
  const Result<SourcePlace> place = locate_source(text);
  if (!place) return tl::unexpected(place.error());
  if (place->server) return open_on_server(*place->server, options);
  Result<std::shared_ptr<const AssetFile>> asset = AssetFile::open(text);
  if (!asset) return tl::unexpected(asset.error());
  return std::make_unique<FileSource>(std::move(*asset), text, options.client.stop);
}

}  // namespace fanstream
