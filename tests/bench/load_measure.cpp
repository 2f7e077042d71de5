#include "tests/bench/load_measure.h"

#include <xxhash.h>

#include "common/support/descriptor_limit.h"
#include "server/net/stream_server.h"

namespace fanstream::bench {

namespace {

constexpr const char* kModel = "model";

class OneModel final : public ModelProvider {
 public:
  explicit OneModel(std::shared_ptr<const OpenAsset> asset) : asset_(std::move(asset)) {}
  std::vector<CatalogueEntry> catalogue() override {
    CatalogueEntry entry;
    entry.name = kModel;
    entry.digest = asset_->digest();
    entry.size_bytes = asset_->size_bytes();
    entry.vertex_count = asset_->vertex_count();
    entry.triangle_count = asset_->triangle_count();
    return {entry};
  }
  ModelStatus open(const std::string& name) override {
    ModelStatus status;
    if (name != kModel) return status;
    status.state = ModelStatus::State::ready;
    status.source = asset_;
    return status;
  }

 private:
  std::shared_ptr<const OpenAsset> asset_;
};

// What LoadOutcome::content_hash must be.
std::uint64_t content_hash(const OpenAsset& asset) {
  const auto hash = [](std::span<const std::byte> bytes, std::uint64_t seed) {
    return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
  };
  const Digest digest = asset.digest();
  std::uint64_t sum = hash(std::as_bytes(std::span(digest)), 1) + hash(asset.head(), 2) + hash(asset.index(), 3);
  for (std::uint32_t c = 0; c < asset.cell_count(); ++c) {
    for (std::uint32_t s = 0; s < asset.segment_count(c); ++s) {
      if (asset.segment(c, s).empty()) continue;  // never sent
      sum += hash(asset.segment(c, s), (std::uint64_t{c} << 32U | s) + 4);
    }
  }
  return sum;
}

}  // namespace

Result<LoadMeasurement> measure_load(std::shared_ptr<const OpenAsset> asset, std::uint32_t clients,
                                     const std::function<void(std::uint32_t, std::uint64_t)>& on_progress) {
  const std::uint64_t descriptors = raise_descriptor_limit();
  constexpr std::uint64_t kOwnDescriptors = 64;
  if (descriptors != 0 && 2ULL * clients + kOwnDescriptors > descriptors) {
    return fail(ErrorKind::limit, std::to_string(clients) + " clients and their server need more than the " +
                                      std::to_string(descriptors) +
                                      " descriptors a process may have; raise ulimit -Hn");
  }
  ServerOptions options;
  options.host = "127.0.0.1";
  options.port = 0;
  Result<std::unique_ptr<StreamServer>> server = StreamServer::start(options, std::make_shared<OneModel>(asset));
  if (!server) return tl::unexpected(server.error());
  LoadOptions load;
  load.address = {"127.0.0.1", (*server)->port(), kModel};
  load.clients = clients;
  LoadMeasurement result;
  result.report = run_load(load, on_progress);
  result.server_sent_bytes = (*server)->metrics().sent_bytes;
  (*server)->stop();
  result.exact = result.report.complete == clients && result.report.distinct_contents == 1 &&
                 result.report.content_hash == content_hash(*asset);
  return result;
}

}  // namespace fanstream::bench
