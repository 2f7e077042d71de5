#include "server/store/model_store.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "common/asset/asset_file.h"
#include "tests/support/mesh_files.h"
#include "tests/support/small_assets.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class ModelStoreTest : public ::testing::Test {
 protected:
  std::unique_ptr<ModelStore> open(StoreOptions options = {}) {
    options.models = folder.path() / "models";
    options.store = folder.path() / "store";
    if (!options.build.position_bits) options.build = testing::small_build_options();
    options.on_event = [this](const StoreEvent& event) {
      if (event.kind == StoreEvent::Kind::building) ++builds;
    };
    fs::create_directories(options.models);
    Result<std::unique_ptr<ModelStore>> opened = ModelStore::open(options);
    EXPECT_TRUE(opened.has_value()) << opened.error().message;
    return opened ? std::move(*opened) : nullptr;
  }
  std::unique_ptr<ModelStore> open_and_settle(const StoreOptions& options = {}) {
    auto store = open(options);
    EXPECT_TRUE(store->wait_until_settled(60s));
    return store;
  }
  void write_model(const std::string& name, const TriangleMesh& mesh) const {
    folder.write("models/" + name, testing::ply_binary(mesh, false));
  }
  std::vector<std::string> stored() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder.path() / "store")) names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }
  static std::vector<std::string> names(ModelStore& store) {
    std::vector<std::string> all;
    for (const CatalogueEntry& entry : store.catalogue()) all.push_back(entry.name);
    return all;
  }

  testing::TemporaryFolder folder;
  std::atomic<int> builds{0};
};

TEST_F(ModelStoreTest, BuildsWhatIsMissingAndOffersIt) {
  write_model("torus.ply", testing::make_torus(20, 12));
  write_model("sphere.PLY", testing::make_sphere(10, 12));
  folder.write("models/notes.txt", "not a model");
  folder.write("models/.hidden.ply", "not looked at");
  auto store = open_and_settle();
  EXPECT_EQ(names(*store), (std::vector<std::string>{"sphere", "torus"}));
  const ModelStatus status = store->open("torus");
  ASSERT_EQ(status.state, ModelStatus::State::ready);
  EXPECT_EQ(status.source->vertex_count(), 240U);
  const CatalogueEntry entry = store->catalogue()[1];
  EXPECT_EQ(entry.state, ModelState::ready);
  EXPECT_EQ(entry.digest, status.source->digest());
  EXPECT_EQ(entry.triangle_count, 480U);
  EXPECT_EQ(entry.size_bytes, status.source->size_bytes());
  EXPECT_EQ(store->open("no such model").state, ModelStatus::State::unknown);
  EXPECT_EQ(stored().size(), 2U);
}

TEST_F(ModelStoreTest, WhatIsBuiltIsNotBuiltAgain) {
  write_model("torus.ply", testing::make_torus(20, 12));
  const Digest first = open_and_settle()->open("torus").source->digest();
  const auto before = stored();
  EXPECT_EQ(builds, 1);
  auto store = open_and_settle();
  EXPECT_EQ(builds, 1);
  EXPECT_EQ(store->open("torus").source->digest(), first);
  EXPECT_EQ(stored(), before);
}

TEST_F(ModelStoreTest, ChangedSourceOrOptionsReplaceTheAsset) {
  write_model("torus.ply", testing::make_torus(20, 12));
  open_and_settle();
  const auto before = stored();
  write_model("torus.ply", testing::make_torus(22, 12));
  open_and_settle();
  const auto changed = stored();
  ASSERT_EQ(changed.size(), 1U);
  EXPECT_NE(changed, before);
  StoreOptions options;
  options.build = testing::small_build_options();
  options.build.position_bits = 12;
  open_and_settle(options);
  ASSERT_EQ(stored().size(), 1U);
  EXPECT_NE(stored(), changed);
  EXPECT_EQ(builds, 3);
}

TEST_F(ModelStoreTest, BufferOfAGltfFileCountsAsSource) {
  const testing::GltfDraft draft = testing::gltf_draft(testing::make_torus(20, 12));
  folder.write("models/torus.gltf", draft.as_gltf_with_uri("torus.bin"));
  folder.write("models/torus.bin", draft.binary);
  open_and_settle();
  const auto before = stored();
  std::string moved = draft.binary;
  moved[3] = static_cast<char>(moved[3] ^ 1);  // the exponent of the first coordinate
  folder.write("models/torus.bin", moved);
  open_and_settle();
  ASSERT_EQ(stored().size(), 1U);
  EXPECT_NE(stored(), before);
}

TEST_F(ModelStoreTest, BadModelFailsWithItsReasonAndOthersGoOn) {
  folder.write("models/bad.ply", "not a ply file");
  folder.write("models/empty.stl", "");
  fs::create_symlink("nowhere", folder.path() / "models" / "dangling.obj");
  write_model("torus.ply", testing::make_torus(20, 12));
  auto store = open_and_settle();
  EXPECT_EQ(names(*store), (std::vector<std::string>{"bad", "empty", "torus"}));
  const ModelStatus bad = store->open("bad");
  EXPECT_EQ(bad.state, ModelStatus::State::failed);
  EXPECT_TRUE(bad.reason.starts_with("bad.ply: ")) << bad.reason;
  EXPECT_EQ(store->catalogue()[0].reason, bad.reason);
  EXPECT_EQ(store->open("empty").state, ModelStatus::State::failed);
  EXPECT_EQ(store->open("torus").state, ModelStatus::State::ready);
  EXPECT_EQ(stored().size(), 1U);
}

TEST_F(ModelStoreTest, FilesOfOneStemKeepTheirExtensions) {
  const TriangleMesh torus = testing::make_torus(20, 12);
  write_model("torus.ply", torus);
  folder.write("models/torus.off", testing::off_text(torus));
  write_model("torus.ply.ply", torus);  // its stem meets the first one's whole name
  write_model("other.ply", torus);
  EXPECT_EQ(names(*open_and_settle()), (std::vector<std::string>{"other", "torus.off", "torus.ply", "torus.ply.ply"}));
  EXPECT_EQ(stored().size(), 4U);
}

TEST_F(ModelStoreTest, DamagedAssetInTheStoreIsBuiltAgain) {
  write_model("torus.ply", testing::make_torus(20, 12));
  const Digest digest = open_and_settle()->open("torus").source->digest();
  const fs::path path = folder.path() / "store" / stored().at(0);
  fs::resize_file(path, fs::file_size(path) - 10);
  auto store = open_and_settle();
  ASSERT_EQ(store->open("torus").state, ModelStatus::State::ready);
  EXPECT_EQ(store->open("torus").source->digest(), digest);
  EXPECT_EQ(builds, 2);
  EXPECT_EQ(stored().size(), 1U);
}

TEST_F(ModelStoreTest, ReadyAssetIsCopiedSoThatOverwritingItIsHarmless) {
  const std::vector<std::byte> bytes = testing::small_asset();
  const fs::path path = folder.write("models/torus.fan", testing::as_text(bytes));
  folder.write("models/cut.fan", testing::as_text(bytes).substr(0, 100));
  auto store = open_and_settle();
  EXPECT_EQ(store->open("cut").state, ModelStatus::State::failed);
  const ModelStatus status = store->open("torus");
  ASSERT_EQ(status.state, ModelStatus::State::ready);
  fs::resize_file(path, 0);
  const auto* asset = dynamic_cast<const AssetFile*>(status.source.get());
  ASSERT_NE(asset, nullptr);
  EXPECT_TRUE(std::equal(asset->bytes().begin(), asset->bytes().end(), bytes.begin(), bytes.end()));
  EXPECT_EQ(stored().size(), 1U);
}

TEST_F(ModelStoreTest, AssetsWhoseSourceIsGoneAreKept) {
  write_model("torus.ply", testing::make_torus(20, 12));
  write_model("sphere.ply", testing::make_sphere(10, 12));
  open_and_settle();
  fs::remove(folder.path() / "models" / "sphere.ply");
  open_and_settle();
  EXPECT_EQ(stored().size(), 2U);
}

TEST_F(ModelStoreTest, LeftoversOfAKilledServerAreRemoved) {
  write_model("torus.ply", testing::make_torus(20, 12));
  const std::string ours = "torus-0123456789abcdef.fan.tmp-" + std::to_string(::getpid()) + "-1";
  const std::string of_a_living_process = "torus-0123456789abcdef.fan.tmp-1-1";
  folder.write("store/" + ours, "half");
  folder.write("store/" + of_a_living_process, "half");
  open_and_settle();
  EXPECT_FALSE(fs::exists(folder.path() / "store" / ours));
  EXPECT_TRUE(fs::exists(folder.path() / "store" / of_a_living_process));
}

TEST_F(ModelStoreTest, StopWhileBuildingLeavesNoHalfWrittenFile) {
  for (int i = 0; i < 12; ++i) write_model("torus" + std::to_string(i) + ".ply", testing::make_torus(120, 60));
  auto store = open();
  store->open("torus7");
  EXPECT_TRUE(store->stop(60s));
  const auto after_stop = stored();
  EXPECT_LT(after_stop.size(), 12U);
  for (const std::string& name : after_stop) {
    EXPECT_TRUE(name.ends_with(".fan")) << name;
    EXPECT_TRUE(AssetFile::open(folder.path() / "store" / name).has_value()) << name;
  }
  for (const CatalogueEntry& entry : store->catalogue()) EXPECT_NE(entry.state, ModelState::failed) << entry.reason;
  store.reset();
  EXPECT_EQ(stored(), after_stop);
}

TEST_F(ModelStoreTest, AskedFromManyThreadsWhileBuilding) {
  for (int i = 0; i < 6; ++i)
    write_model("torus" + std::to_string(i) + ".ply", testing::make_torus(30 + static_cast<unsigned>(i), 20));
  StoreOptions options;
  options.build_threads = 3;
  auto store = open(options);
  std::vector<std::thread> threads;
  std::atomic<int> ready{0};
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      double before = 0;
      for (const std::string name = "torus" + std::to_string(t);;) {
        const ModelStatus status = store->open(name);
        store->catalogue();
        EXPECT_GE(status.fraction, before);
        before = status.fraction;
        if (status.state != ModelStatus::State::building) {
          ready += status.state == ModelStatus::State::ready ? 1 : 0;
          return;
        }
        std::this_thread::yield();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(ready, 4);
}

TEST_F(ModelStoreTest, FoldersThatCannotBeUsedAreNamedAtOnce) {
  StoreOptions options;
  options.models = folder.path() / "missing";
  options.store = folder.path() / "store";
  auto opened = ModelStore::open(options);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().kind, ErrorKind::not_found);
  EXPECT_NE(opened.error().message.find("missing"), std::string::npos);

  options.models = folder.path();
  options.store = folder.write("file", "x") / "store";  // below a file
  opened = ModelStore::open(options);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().kind, ErrorKind::io);
  EXPECT_NE(opened.error().message.find("choose another folder with --store"), std::string::npos)
      << opened.error().message;

  options.store = "/proc/fanstream-store";
  opened = ModelStore::open(options);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().kind, ErrorKind::io);

  options.store = folder.path();
  opened = ModelStore::open(options);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().kind, ErrorKind::usage);
}

}  // namespace
}  // namespace fanstream
