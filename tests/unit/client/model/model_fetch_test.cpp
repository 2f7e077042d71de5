#include "client/model/model_fetch.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/mesh/manifold_check.h"
#include "common/mesh/mesh_hash.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/built_model.h"
#include "tests/support/cutting_relay.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using testing::ModelServer;

struct Model {
  TriangleMesh mesh;
  std::shared_ptr<const AssetFile> asset;
};

const Model& terrain() {
  static const Model model = [] {
    const TriangleMesh mesh = testing::make_terrain(70, 70, 9);
    return Model{mesh, testing::build_model(mesh, testing::small_cells())};  // with pages
  }();
  return model;
}

std::unique_ptr<ModelFetch> open(const std::string& source, const FetchOptions& options = {}) {
  auto fetch = ModelFetch::open(source, options);
  EXPECT_TRUE(fetch) << fetch.error().message;
  return fetch ? std::move(*fetch) : nullptr;
}

std::string write_asset(const testing::TemporaryFolder& folder, const AssetFile& asset, const std::string& name) {
  return folder.write(name, {reinterpret_cast<const char*>(asset.bytes().data()), asset.bytes().size()}).string();
}

void expect_text(const Error& error, const std::string& text) {
  EXPECT_NE(error.message.find(text), std::string::npos) << error.message;
}

// Its server leaves the last segment out and says that it is done.
TEST(ModelFetch, AServerThatLacksASegmentIsAnErrorAndNoWaitWithoutEnd) {
  class Lacking final : public SegmentSource {
   public:
    Digest digest() const override { return whole().digest(); }
    std::span<const std::byte> head() const override { return whole().head(); }
    std::span<const std::byte> index() const override { return whole().index(); }
    std::uint32_t cell_count() const override { return whole().cell_count(); }
    std::uint32_t segment_count(std::uint32_t cell) const override { return whole().segment_count(cell); }
    std::span<const std::byte> segment(std::uint32_t cell, std::uint32_t segment) const override {
      if (cell == last_.cell && segment == last_.segment) return {};
      return whole().segment(cell, segment);
    }
    std::uint64_t vertex_count() const override { return whole().vertex_count(); }
    std::uint64_t triangle_count() const override { return whole().triangle_count(); }
    std::uint64_t size_bytes() const override { return whole().size_bytes(); }

   private:
    static const AssetFile& whole() { return *terrain().asset; }
    static OrderedSegment last_of_order() {
      const std::vector<OrderedSegment> order = order_segments(*whole().asset_head(), *whole().asset_index());
      const auto last = std::find_if(order.rbegin(), order.rend(), [](const auto& s) { return s.size_bytes > 0; });
      return *last;
    }
    OrderedSegment last_ = last_of_order();
  };
  ModelServer server;
  server.add("lacking", std::make_shared<Lacking>());
  const auto fetch = open(server.address() + "/lacking");
  ASSERT_TRUE(fetch);
  const auto advanced = fetch->advance({});
  ASSERT_FALSE(advanced);
  EXPECT_EQ(advanced.error().kind, ErrorKind::bad_input);
  expect_text(advanced.error(), "without having sent segment");
}

TEST(ModelFetch, OverANetworkGivesTheQuantisedInputFaceForFace) {
  TriangleMesh parts = testing::make_torus(40, 30);
  testing::append(parts, testing::make_open_cylinder(20, 12), {3, 0, 0});
  const std::vector<TriangleMesh> meshes = {testing::make_tetrahedron(), testing::make_sphere(40, 50), terrain().mesh,
                                            parts, testing::make_grid(1, 1)};
  ModelServer server;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    SCOPED_TRACE(i);
    const auto asset =
        i % 2 == 0 ? testing::build_model(meshes[i]) : testing::build_model(meshes[i], testing::small_cells());
    EXPECT_EQ(asset->asset_head()->has_pages, i % 2 != 0);
    const std::string name = "model" + std::to_string(i);
    server.add(name, asset);
    const auto fetch = open(server.address() + "/" + name);
    ASSERT_TRUE(fetch);
    const auto advanced = fetch->advance({});
    ASSERT_TRUE(advanced) << advanced.error().message;
    EXPECT_EQ(mesh_hash(fetch->mesh().triangle_mesh()), testing::quantised_hash(meshes[i], *asset));
    const FetchReport report = fetch->report();
    EXPECT_TRUE(report.complete);
    EXPECT_EQ(report.model, name);
    EXPECT_EQ(report.digest, text_of(asset->digest()));
    EXPECT_EQ(report.vertices, meshes[i].positions.size());
    EXPECT_EQ(report.triangles, meshes[i].triangles.size());
    const std::uint64_t sent =
        asset->preamble().section_bytes() - range_table_bytes(*asset->asset_head(), *asset->asset_index());
    EXPECT_EQ(report.bytes.head + report.bytes.index + report.bytes.segments, sent);
    EXPECT_GT(report.bytes.received, sent);
    EXPECT_EQ(report.segments, report.segments_total);
    EXPECT_LE(report.seconds.connect, report.seconds.head);
    EXPECT_LE(report.seconds.head, report.seconds.first_mesh);
    EXPECT_LE(report.seconds.first_mesh, report.seconds.complete);
  }
}

TEST(ModelFetch, AFileGivesTheSameMeshAsAServerAtEveryLevel) {
  const testing::TemporaryFolder folder;
  const std::string path = write_asset(folder, *terrain().asset, "terrain.fan");
  ModelServer server;
  server.add("terrain", terrain().asset);
  const std::uint64_t full = terrain().mesh.positions.size();
  for (const std::uint64_t vertices : {std::uint64_t{1}, std::uint64_t{400}, full / 2, full - 1, full}) {
    SCOPED_TRACE(vertices);
    const auto from_file = open(path);
    const auto from_server = open(server.address() + "/terrain");
    ASSERT_TRUE(from_file->advance({vertices, {}}));
    ASSERT_TRUE(from_server->advance({vertices, {}}));
    EXPECT_EQ(mesh_hash(from_file->mesh().triangle_mesh()), mesh_hash(from_server->mesh().triangle_mesh()));
    EXPECT_EQ(from_file->report().model, "terrain");
    EXPECT_GE(from_file->mesh().vertex_count(), vertices);
  }
}

TEST(ModelFetch, TheMeshGrowsWhileItArrivesAndStaysManifold) {
  ModelServer server;
  server.add("terrain", terrain().asset);
  const auto fetch = open(server.address() + "/terrain");
  std::uint64_t vertices = 0;
  std::string why;
  for (double goal = 1; goal < 2e4; goal *= 1.5) {
    const auto advanced = fetch->advance({std::llround(goal), {}});
    ASSERT_TRUE(advanced) << advanced.error().message;
    EXPECT_GE(fetch->mesh().vertex_count(), vertices);
    EXPECT_GE(fetch->mesh().vertex_count(),
              std::min<std::uint64_t>(std::llround(goal), terrain().mesh.positions.size()));
    vertices = fetch->mesh().vertex_count();
    EXPECT_TRUE(is_oriented_manifold(fetch->mesh().triangle_mesh(), &why)) << why;
  }
  EXPECT_TRUE(fetch->report().complete) << "the last goal is beyond the model";
}

TEST(ModelFetch, BytesAreABoundOnWhatIsReceivedAndMoreBytesGiveMore) {
  const testing::TemporaryFolder folder;
  const std::string path = write_asset(folder, *terrain().asset, "terrain.fan");
  ModelServer server;
  server.add("terrain", terrain().asset);
  const std::uint64_t least = terrain().asset->head().size() + terrain().asset->index().size();
  const std::uint64_t all = terrain().asset->size_bytes();
  for (const std::string& source : {path, server.address() + "/terrain"}) {
    SCOPED_TRACE(source);
    std::uint64_t vertices = 0;
    for (std::uint64_t bytes = least + 200; bytes < all + all / 4; bytes += all / 12) {
      SCOPED_TRACE(bytes);
      const auto fetch = open(source);
      const auto advanced = fetch->advance({{}, bytes});
      ASSERT_TRUE(advanced) << advanced.error().message;
      const FetchReport report = fetch->report();
      EXPECT_LE(report.bytes.received, bytes);
      EXPECT_GE(report.vertices, vertices);
      std::string why;
      EXPECT_TRUE(is_oriented_manifold(fetch->mesh().triangle_mesh(), &why)) << why;
      vertices = report.vertices;
      if (!report.complete) {
        EXPECT_GT(report.bytes.received + 2'000, bytes) << "most of what was allowed is used";
      }
    }
    EXPECT_EQ(vertices, terrain().mesh.positions.size());
  }
}

TEST(ModelFetch, FewerBytesThanTheHeadGiveTheBase) {
  ModelServer server;
  server.add("terrain", terrain().asset);
  const auto fetch = open(server.address() + "/terrain");
  ASSERT_TRUE(fetch->advance({{}, 10}));
  EXPECT_EQ(fetch->mesh().vertex_count(), terrain().asset->asset_head()->base.places.size());
  EXPECT_FALSE(fetch->report().complete);
  ASSERT_TRUE(fetch->advance({})) << "one can go on from there";
  EXPECT_TRUE(fetch->report().complete);
}

TEST(ModelFetch, AServerGoneMidStreamLeavesAMeshAndSaysHowMuchCame) {
  ModelServer server;
  server.add("terrain", terrain().asset);
  const std::size_t all = terrain().asset->size_bytes();
  for (const std::size_t cut : {terrain().asset->head().size() + 300, all * 4 / 5, all - 100}) {
    SCOPED_TRACE(cut);
    const testing::CuttingRelay relay(server.port(), cut);
    const std::string host = "127.0.0.1:" + std::to_string(relay.port());
    const auto fetch = open(host + "/terrain");
    ASSERT_TRUE(fetch);
    const auto advanced = fetch->advance({});
    ASSERT_FALSE(advanced);
    EXPECT_EQ(advanced.error().kind, ErrorKind::network);
    expect_text(advanced.error(), host);
    expect_text(advanced.error(), std::to_string(cut) + " bytes");
    expect_text(advanced.error(), "of " + std::to_string(terrain().mesh.positions.size()) + " vertices");
    EXPECT_EQ(fetch->report().bytes.received, cut);
    EXPECT_FALSE(fetch->report().complete);
    std::string why;
    EXPECT_TRUE(is_oriented_manifold(fetch->mesh().triangle_mesh(), &why)) << why;
    if (cut >= all * 4 / 5) {
      EXPECT_GT(fetch->mesh().vertex_count(), terrain().asset->asset_head()->base.places.size());
    }
    EXPECT_FALSE(fetch->advance({})) << "it is over";
  }
}

TEST(ModelFetch, AServerThatStopsSaysSo) {
  ModelServer server;
  server.add("terrain", terrain().asset);
  FetchOptions options;
  options.source.client.session.window_bytes = 2 * kMaxChunkBytes;
  const auto fetch = open(server.address() + "/terrain", options);
  server.server->stop();
  const auto advanced = fetch->advance({});
  ASSERT_FALSE(advanced);
  EXPECT_EQ(advanced.error().kind, ErrorKind::network);
  expect_text(advanced.error(), server.address());
}

TEST(ModelFetch, WaitsWhileTheServerBuilds) {
  ModelServer server;
  ModelStatus building;
  building.state = ModelStatus::State::building;
  building.fraction = 0.25;
  server.models->set("terrain", building);
  FetchOptions options;
  std::vector<double> told;
  options.source.on_building = [&](double fraction) {
    told.push_back(fraction);
    server.add("terrain", terrain().asset);
  };
  const auto fetch = open(server.address() + "/terrain", options);
  ASSERT_TRUE(fetch);
  EXPECT_EQ(told, std::vector<double>{0.25});
}

TEST(ModelFetch, TheStopFlagEndsItWithTheMeshSoFar) {
  const testing::TemporaryFolder folder;
  ModelServer server;
  server.add("terrain", terrain().asset);
  for (const std::string& source :
       {write_asset(folder, *terrain().asset, "terrain.fan"), server.address() + "/terrain"}) {
    SCOPED_TRACE(source);
    std::atomic<bool> stop{false};
    FetchOptions options;
    options.source.client.stop = &stop;
    const auto fetch = open(source, options);
    ASSERT_TRUE(fetch->advance({500, {}}));
    stop = true;
    const auto advanced = fetch->advance({});
    ASSERT_FALSE(advanced);
    EXPECT_EQ(advanced.error().kind, ErrorKind::interrupted);
    EXPECT_GE(fetch->mesh().vertex_count(), 500U);
  }
}

// A source whose bytes are right one by one, but not the announced asset.
class OtherDigest final : public SegmentSource {
 public:
  explicit OtherDigest(std::shared_ptr<const AssetFile> asset) : asset_(std::move(asset)) {
    head_.assign(asset_->head().begin(), asset_->head().end());
    digest_ = asset_->digest();
    digest_[3] ^= 1U;
    for (std::size_t i = 0; i < digest_.size(); ++i)
      head_[kPreambleBytes - 16 + i] = static_cast<std::byte>(digest_[i]);
  }
  Digest digest() const override { return digest_; }
  std::span<const std::byte> head() const override { return head_; }
  std::span<const std::byte> index() const override { return asset_->index(); }
  std::uint32_t cell_count() const override { return asset_->cell_count(); }
  std::uint32_t segment_count(std::uint32_t cell) const override { return asset_->segment_count(cell); }
  std::span<const std::byte> segment(std::uint32_t c, std::uint32_t s) const override { return asset_->segment(c, s); }
  std::uint64_t vertex_count() const override { return asset_->vertex_count(); }
  std::uint64_t triangle_count() const override { return asset_->triangle_count(); }
  std::uint64_t size_bytes() const override { return asset_->size_bytes(); }

 private:
  std::shared_ptr<const AssetFile> asset_;
  std::vector<std::byte> head_;
  Digest digest_;
};

TEST(ModelFetch, ContentThatIsNotWhatItsDigestSaysIsRefused) {
  ModelServer server;
  server.add("terrain", std::make_shared<OtherDigest>(terrain().asset));
  const auto fetch = open(server.address() + "/terrain");
  ASSERT_TRUE(fetch);
  const auto advanced = fetch->advance({});
  ASSERT_FALSE(advanced);
  EXPECT_EQ(advanced.error().kind, ErrorKind::bad_input);
  expect_text(advanced.error(), "digest");
}

TEST(ModelFetch, RandomBytesFromAServerAreRefused) {
  ModelServer server;
  server.add("noise", std::make_shared<SyntheticSource>(SyntheticShape{}));
  const auto fetch = ModelFetch::open(server.address() + "/noise", {});
  ASSERT_FALSE(fetch);
  expect_text(fetch.error(), server.address() + "/noise");
}

TEST(ModelFetch, SourcesThatAreNotThereAreNamed) {
  const testing::TemporaryFolder folder;
  ModelServer server;
  const std::string empty = folder.write("empty.fan", "").string();
  const std::string text = folder.write("text.fan", "solid cube\n").string();
  std::uint16_t unused = 0;
  {
    const RawListener listener;
    unused = listener.port();
  }
  const std::vector<std::tuple<std::string, ErrorKind, std::string>> cases = {
      {"no/such.fan", ErrorKind::not_found, "no/such.fan"},
      {empty, ErrorKind::bad_input, "empty"},
      {text, ErrorKind::bad_input, "text.fan"},
      {folder.path().string(), ErrorKind::io, "directory"},
      {server.address() + "/none", ErrorKind::not_found, "no such model"},
      {server.address(), ErrorKind::usage, "names no model"},
      {"localhost:http/bunny", ErrorKind::usage, "port"},
      {"127.0.0.1:" + std::to_string(unused) + "/bunny", ErrorKind::network, "refused"}};
  for (const auto& [source, kind, part] : cases) {
    SCOPED_TRACE(source);
    const auto fetch = ModelFetch::open(source, {});
    ASSERT_FALSE(fetch);
    EXPECT_EQ(fetch.error().kind, kind) << fetch.error().message;
    expect_text(fetch.error(), part);
  }
}

}  // namespace
}  // namespace fanstream
