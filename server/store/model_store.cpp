#include "server/store/model_store.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <thread>

#include "common/asset/asset_file.h"
#include "common/support/atomic_file.h"
#include "server/store/asset_folder.h"
#include "server/store/model_build.h"
#include "server/store/model_folder.h"
#include "server/store/source_key.h"

namespace fanstream {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kBuildNiceness = 10;  // clients first

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

Result<std::vector<std::byte>> read_whole(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file ? static_cast<std::streamoff>(file.tellg()) : -1;
  if (size < 0) return fail(ErrorKind::io, path.string() + ": cannot be read; check its permissions");
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  file.seekg(0);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), size)) {
    return fail(ErrorKind::io, path.string() + ": cannot be read, or changes while it is read");
  }
  return bytes;
}

}  // namespace

class ModelStore::Impl {
 public:
  Impl(const StoreOptions& options, ModelFolder folder, AssetFolder assets)
      : options_(options), assets_(std::move(assets)), warnings_(std::move(folder.warnings)) {
    for (ModelFile& file : folder.models) models_.push_back({std::move(file)});
    unsigned count = options.build_threads;
    if (count == 0) count = std::max(1U, std::thread::hardware_concurrency() / 2);
    count = static_cast<unsigned>(std::min<std::size_t>(count, std::max<std::size_t>(1, models_.size())));
    for (unsigned i = 0; i < count; ++i) threads_.emplace_back([this] { work(); });
  }
  ~Impl() {
    stop(std::chrono::hours(24 * 365));
    for (std::thread& thread : threads_) thread.join();
  }

  std::vector<CatalogueEntry> catalogue();
  ModelStatus open(const std::string& name);
  bool stop(std::chrono::milliseconds most);
  bool wait_until_settled(std::chrono::milliseconds most);

 private:
  // unseen -> (ready | queued -> building -> ready | failed)
  enum class Stage { unseen, looking, queued, building, ready, failed };
  struct Model {
    ModelFile file;
    Stage stage = Stage::unseen;
    bool asked_for = false;
    double fraction = 0;
    std::string key{};
    std::string reason{};
    std::shared_ptr<const AssetFile> asset{};
  };

  void work();
  Model* next_job();
  void look_up(Model& model);
  void build(Model& model);
  Result<std::shared_ptr<const AssetFile>> make(Model& model);
  Result<std::vector<std::byte>> make_bytes(Model& model);
  void settle(Model& model, Result<std::shared_ptr<const AssetFile>> made, double build_seconds);
  void tell(StoreEvent event);
  std::string without_folder(std::string text) const;

  const StoreOptions options_;
  const AssetFolder assets_;
  std::mutex mutex_;  // guards everything below but the files' names, which never change
  std::condition_variable changed_;
  std::vector<Model> models_;  // sorted by name; never resized after construction
  std::vector<std::string> warnings_;
  std::size_t next_unseen_ = 0;
  std::size_t settled_ = 0;
  unsigned running_ = 0;
  bool stopping_ = false;
  std::mutex writing_;      // held while a file is written; taken before mutex_
  bool abandoned_ = false;  // guarded by writing_
  std::mutex telling_;      // events come one at a time; taken with no other lock held
  std::vector<std::thread> threads_;
};

// First everything is looked up in the store, which is quick, then what it lacks is built.
ModelStore::Impl::Model* ModelStore::Impl::next_job() {
  if (next_unseen_ < models_.size()) return &models_[next_unseen_++];
  Model* found = nullptr;
  for (Model& model : models_) {
    if (model.stage != Stage::queued) continue;
    if (model.asked_for) return &model;
    if (found == nullptr) found = &model;
  }
  return found;
}

void ModelStore::Impl::work() {
  // On Linux niceness is a thread's own.
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kBuildNiceness);
  std::unique_lock lock(mutex_);
  std::vector<std::string> warnings;
  warnings.swap(warnings_);
  lock.unlock();
  for (std::string& warning : warnings) tell({.kind = StoreEvent::Kind::warning, .text = std::move(warning)});
  lock.lock();
  while (!stopping_) {
    Model* model = next_job();
    if (model == nullptr) {
      if (settled_ == models_.size()) return;
      changed_.wait(lock);  // another thread still looks models up, and may queue some
      continue;
    }
    ++running_;
    const bool known = model->stage == Stage::queued;
    model->stage = known ? Stage::building : Stage::looking;
    lock.unlock();
    try {
      known ? build(*model) : look_up(*model);
    } catch (const std::bad_alloc&) {
      settle(*model, fail(ErrorKind::limit, model->file.path.string() + ": not enough memory to build it"), 0);
    }
    lock.lock();
    --running_;
    changed_.notify_all();
  }
}

void ModelStore::Impl::look_up(Model& model) {
  const Result<std::string> key = source_key(model.file.path, options_.build);
  if (!key) return settle(model, tl::unexpected(key.error()), 0);
  const std::filesystem::path stored = assets_.file_of(model.file.name, *key);
  Result<std::shared_ptr<const AssetFile>> found = AssetFile::open(stored);
  {
    const std::lock_guard lock(mutex_);
    model.key = *key;
    if (!found) model.stage = Stage::queued;
  }
  if (found) return settle(model, std::move(found), 0);
  if (found.error().kind != ErrorKind::not_found) {
    tell({.kind = StoreEvent::Kind::warning,
          .model = model.file.name,
          .text = found.error().message + ". It is built again."});
  }
}

void ModelStore::Impl::build(Model& model) {
  tell({.kind = StoreEvent::Kind::building, .model = model.file.name});
  const Clock::time_point start = Clock::now();
  Result<std::shared_ptr<const AssetFile>> made = make(model);
  settle(model, std::move(made), seconds_since(start));
}

Result<std::vector<std::byte>> ModelStore::Impl::make_bytes(Model& model) {
  if (model.file.is_asset) {
    Result<std::vector<std::byte>> bytes = read_whole(model.file.path);
    if (!bytes) return bytes;
    Result<std::shared_ptr<const AssetFile>> checked = AssetFile::from_memory(*bytes, model.file.path.string());
    if (!checked) return tl::unexpected(checked.error());
    return bytes;
  }
  BuildOptions build = options_.build;
  build.progress = [this, &model](std::string_view stage, double fraction) {
    StoreEvent event{.kind = StoreEvent::Kind::progress, .model = model.file.name};
    {
      const std::lock_guard lock(mutex_);
      model.fraction = std::max(model.fraction, overall_fraction(stage, fraction));
      event.fraction = model.fraction;
    }
    tell(std::move(event));
  };
  Result<ModelBuild> built = build_model(model.file.path, build);
  if (!built) return tl::unexpected(built.error());
  for (std::string& warning : built->warnings) {
    tell({.kind = StoreEvent::Kind::warning, .model = model.file.name, .text = std::move(warning)});
  }
  return std::move(built->asset.bytes);
}

Result<std::shared_ptr<const AssetFile>> ModelStore::Impl::make(Model& model) {
  Result<std::vector<std::byte>> bytes = make_bytes(model);
  if (!bytes) return tl::unexpected(bytes.error());
  const std::filesystem::path path = assets_.file_of(model.file.name, model.key);
  {
    const std::lock_guard lock(writing_);
    if (abandoned_) return fail(ErrorKind::interrupted, "the server stops");
    if (Result<void> written = write_file_atomically(path, std::span<const std::byte>(*bytes)); !written) {
      return tl::unexpected(written.error());
    }
  }
  bytes->clear();
  bytes->shrink_to_fit();
  return AssetFile::open(path);
}

void ModelStore::Impl::settle(Model& model, Result<std::shared_ptr<const AssetFile>> made, double build_seconds) {
  StoreEvent event{.kind = made ? StoreEvent::Kind::ready : StoreEvent::Kind::failed, .model = model.file.name};
  if (made) {
    assets_.remove_superseded(model.file.name, model.key);
    event.source = *made;
    event.build_seconds = build_seconds;
  } else {
    event.text = without_folder(made.error().message);
  }
  {
    const std::lock_guard lock(mutex_);
    model.stage = made ? Stage::ready : Stage::failed;
    model.reason = event.text;
    if (made) model.asset = std::move(*made);
    event.models_left = models_.size() - ++settled_;
  }
  changed_.notify_all();
  tell(std::move(event));
}

void ModelStore::Impl::tell(StoreEvent event) {
  if (!options_.on_event) return;
  const std::lock_guard lock(telling_);
  options_.on_event(event);
}

// Reasons go to clients, whom the server's folders do not concern.
std::string ModelStore::Impl::without_folder(std::string text) const {
  for (const std::filesystem::path& folder : {options_.models, options_.store}) {
    const std::string prefix = (folder / "").string();
    for (std::size_t at = text.find(prefix); at != std::string::npos; at = text.find(prefix, at))
      text.erase(at, prefix.size());
  }
  return text;
}

std::vector<CatalogueEntry> ModelStore::Impl::catalogue() {
  const std::lock_guard lock(mutex_);
  std::vector<CatalogueEntry> entries;
  entries.reserve(models_.size());
  for (const Model& model : models_) {
    CatalogueEntry& entry = entries.emplace_back();
    entry.name = model.file.name;
    entry.state = model.stage == Stage::ready    ? ModelState::ready
                  : model.stage == Stage::failed ? ModelState::failed
                                                 : ModelState::building;
    entry.permille = static_cast<std::uint16_t>(model.fraction * 1000.0);
    entry.reason = model.reason;
    if (model.asset == nullptr) continue;
    entry.digest = model.asset->digest();
    entry.size_bytes = model.asset->size_bytes();
    entry.vertex_count = model.asset->vertex_count();
    entry.triangle_count = model.asset->triangle_count();
  }
  return entries;
}

ModelStatus ModelStore::Impl::open(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::lower_bound(models_.begin(), models_.end(), name,
                       [](const Model& model, const std::string& wanted) { return model.file.name < wanted; });
  if (found == models_.end() || found->file.name != name) return {};
  found->asked_for = true;
  ModelStatus status;
  status.state = found->stage == Stage::ready    ? ModelStatus::State::ready
                 : found->stage == Stage::failed ? ModelStatus::State::failed
                                                 : ModelStatus::State::building;
  status.fraction = found->fraction;
  status.reason = found->reason;
  status.source = found->asset;
  return status;
}

bool ModelStore::Impl::stop(std::chrono::milliseconds most) {
  bool idle = false;
  {
    std::unique_lock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
    idle = changed_.wait_for(lock, most, [this] { return running_ == 0; });
  }
  const std::lock_guard lock(writing_);  // waits for a write under way
  abandoned_ = true;
  return idle;
}

bool ModelStore::Impl::wait_until_settled(std::chrono::milliseconds most) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, most, [this] { return settled_ == models_.size(); });
}

ModelStore::ModelStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ModelStore::~ModelStore() = default;
std::vector<CatalogueEntry> ModelStore::catalogue() { return impl_->catalogue(); }
ModelStatus ModelStore::open(const std::string& name) { return impl_->open(name); }
bool ModelStore::stop(std::chrono::milliseconds most) { return impl_->stop(most); }
bool ModelStore::wait_until_settled(std::chrono::milliseconds most) { return impl_->wait_until_settled(most); }

Result<std::unique_ptr<ModelStore>> ModelStore::open(const StoreOptions& options) {
  Result<ModelFolder> folder = list_models(options.models);
  if (!folder) return tl::unexpected(folder.error());
  std::error_code error;
  if (std::filesystem::equivalent(options.models, options.store, error)) {
    return fail(ErrorKind::usage,
                "store " + options.store.string() + ": is the folder of models itself; choose another with --store");
  }
  Result<AssetFolder> assets = AssetFolder::open(options.store);
  if (!assets) return tl::unexpected(assets.error());
  return std::unique_ptr<ModelStore>(
      new ModelStore(std::make_unique<Impl>(options, std::move(*folder), std::move(*assets))));
}

}  // namespace fanstream
