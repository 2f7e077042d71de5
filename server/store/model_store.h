// The models a server offers: built in the background where the store lacks them, mapped from the store when ready.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>

#include "server/build/asset_builder.h"
#include "server/net/model_provider.h"

namespace fanstream {

struct StoreEvent {
  enum class Kind { building, progress, ready, failed, warning };
  Kind kind = Kind::building;
  std::string model{};
  double fraction = 0;                            // progress: of this model's build, 0 to 1
  std::string text{};                             // failed, warning: what and why, a whole sentence
  std::shared_ptr<const SegmentSource> source{};  // ready
  double build_seconds = 0;                       // ready: 0 if it was in the store
  std::size_t models_left = 0;                    // ready, failed: neither ready nor failed yet
};

struct StoreOptions {
  std::filesystem::path models;  // see list_models
  std::filesystem::path store;   // see AssetFolder
  BuildOptions build;            // its `progress` is not used
  // Models that are built at the same time, each with its own memory. 0: half the cores, at least one, so that clients
  // are served meanwhile.
  unsigned build_threads = 0;
  // Called from the build threads, one call at a time. Must not call the store. May be empty.
  std::function<void(const StoreEvent&)> on_event;
};

// All models are looked at once, when the store is opened. What is in the store already is offered first, then the
// others are built in the order of their names, those that clients ask for before the rest. A model that cannot be
// built has failed, with its reason, and the others go on. An asset is replaced only after its successor is written;
// assets whose source is gone are kept. Ready assets (.fan) in the folder of models are checked and copied into the
// store, so that overwriting them cannot harm a running server.
//
// Thread safety: all members may be called from any number of threads at once.
class ModelStore final : public ModelProvider {
 public:
  // Returns at once and goes on in the background. Fails if a folder is missing or cannot be read or written.
  static Result<std::unique_ptr<ModelStore>> open(const StoreOptions& options);
  ~ModelStore() override;  // waits for the builds that run
  ModelStore(const ModelStore&) = delete;
  ModelStore& operator=(const ModelStore&) = delete;

  std::vector<CatalogueEntry> catalogue() override;
  ModelStatus open(const std::string& name) override;

  // Starts no more builds and waits for those that run, at most this long. False if some still run: they will not write
  // anything any more, so that the process may end (std::_Exit) without leaving a half-written file.
  bool stop(std::chrono::milliseconds most);
  // Until every model is ready or has failed. False if the time is over before.
  bool wait_until_settled(std::chrono::milliseconds most);

 private:
  class Impl;
  explicit ModelStore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fanstream
