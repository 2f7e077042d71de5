#include "common/refine/source_polygons.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/asset/asset_file.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_sources.h"

namespace fanstream {
namespace {

using testing::OpenAsset;
using testing::PlacedFace;
using testing::SeededRandom;

struct Model {
  std::string name;
  TriangleMesh mesh;
  std::vector<std::uint32_t> source_faces;
};

std::vector<Model> models() {
  std::vector<Model> all;
  const auto add = [&](const std::string& name, TriangleMesh mesh, std::vector<std::uint32_t> faces) {
    all.push_back({name, std::move(mesh), std::move(faces)});
  };
  const TriangleMesh torus = testing::make_torus(30, 20);
  add("quads", torus, testing::paired_source_faces(torus));
  const TriangleMesh terrain = testing::make_terrain(30, 24, 5);
  add("quads with a boundary", terrain, testing::paired_source_faces(terrain));
  add("one quad", testing::make_grid(1, 1), {0, 0});
  const TriangleMesh small = testing::make_torus(5, 4);
  add("FM0 alone", small, testing::paired_source_faces(small));
  std::uint64_t seed = 10;
  for (const auto& [name, mesh] : testing::model_shapes()) {
    add("mixed, " + name, mesh, testing::random_source_faces(mesh, 2 + seed % 9, seed));
    ++seed;
  }
  return all;
}

OpenAsset built(const Model& model) {
  BuildOptions options = testing::small_cells();
  options.source_faces = model.source_faces;
  return testing::build_and_open(model.mesh, options);
}

std::span<const std::byte> polygon_bytes(const OpenAsset& asset) {
  return std::span(asset.bytes).subspan(asset.index->polygon_offset, asset.index->polygons.size_bytes);
}

SourcePolygons polygons_of(const OpenAsset& asset) {
  auto read = SourcePolygons::read(polygon_bytes(asset), *asset.head, *asset.index, "asset");
  EXPECT_TRUE(read) << read.error().message;
  return std::move(*read);
}

TEST(SourcePolygons, AreInTheFullMeshWhatTheyWereInTheSource) {
  for (const Model& model : models()) {
    SCOPED_TRACE(model.name);
    const OpenAsset asset = built(model);
    const TriangleMesh on_grid = testing::on_grid(model.mesh, asset.head->grid);
    const std::vector<PlacedFace> expected = testing::source_polygons(on_grid, model.source_faces);
    ASSERT_EQ(asset.index->polygons.size_bytes == 0, expected.empty());
    if (expected.empty()) continue;
    SourcePolygons polygons = polygons_of(asset);
    const auto mesh = testing::fully_refined(asset);
    const Result<void> updated = polygons.update(*mesh);
    ASSERT_TRUE(updated) << updated.error().message;
    const LiveFaces live = live_faces(*mesh, &polygons);
    EXPECT_EQ(testing::placed_polygons(live.faces, live.positions), expected);
    EXPECT_EQ(std::count(live.finest.begin(), live.finest.end(), 0), 0);
    EXPECT_EQ(polygons.section().quads + polygons.section().larger, expected.size());
    EXPECT_EQ(live.positions, mesh->triangle_mesh().positions);
    EXPECT_EQ(live.triangles, mesh->triangle_mesh().triangles);
  }
}

TEST(SourcePolygons, AnAssetWithoutPolygonsIsTheSameToTheByte) {
  const TriangleMesh torus = testing::make_torus(20, 12);
  BuildOptions options = testing::small_cells();
  const std::vector<std::byte> plain = build_asset(torus, options)->bytes;
  std::vector<std::uint32_t> each(torus.triangles.size());
  for (std::uint32_t t = 0; t < each.size(); ++t) each[t] = t;
  options.source_faces = each;
  EXPECT_EQ(build_asset(torus, options)->bytes, plain);
  // What is no disc is no polygon either.
  const std::vector<std::uint32_t> one(torus.triangles.size(), 0);
  options.source_faces = one;
  EXPECT_EQ(build_asset(torus, options)->bytes, plain);
}

// All of the asset but for what concerns polygons is as without them.
TEST(SourcePolygons, LeaveSegmentsAndIndexAsTheyAre) {
  const TriangleMesh torus = testing::make_torus(20, 12);
  const OpenAsset plain = testing::build_and_open(torus);
  const OpenAsset with = built({"", torus, testing::paired_source_faces(torus)});
  ASSERT_GT(with.index->polygons.size_bytes, 0U);
  EXPECT_TRUE(std::ranges::equal(plain.index_bytes(), with.index_bytes()));
  EXPECT_EQ(plain.preamble.segment_bytes + with.index->polygons.size_bytes, with.preamble.segment_bytes);
}

// A quad takes less than two bits: which of the edges are diagonals mostly follows from others.
TEST(SourcePolygons, CostLittle) {
  const TriangleMesh terrain = testing::make_terrain(60, 50, 5);
  const std::vector<std::uint32_t> faces = testing::paired_source_faces(terrain);
  BuildOptions options;
  options.source_faces = faces;
  const BuildReport report = build_asset(terrain, options)->report;
  EXPECT_EQ(report.quads, 3000U);
  EXPECT_LT(8.0 * static_cast<double>(report.polygon_bytes), 2.0 * 3000.0);
  EXPECT_GT(report.polygon_bytes, 50U);
}

// In meshes that are refined here and there: every face that is said to be finest is one of the full model, every other
// one a triangle; whatever the way there, the same; and where all around is finest, nothing is missing.
TEST(SourcePolygons, ArePartlyRefinedMeshesFacesOfTheFullModel) {
  for (const Model& model : models()) {
    SCOPED_TRACE(model.name);
    const OpenAsset asset = built(model);
    if (asset.index->polygons.size_bytes == 0) continue;
    const TriangleMesh on_grid = testing::on_grid(model.mesh, asset.head->grid);
    std::vector<std::uint8_t> inner = inner_edges(on_grid.triangles, model.source_faces);
    const JoinedFaces joined = join_triangles(on_grid.triangles, inner);
    std::vector<PlacedFace> full;
    for (std::uint32_t f = 0; f < joined.face_count(); ++f) {
      full.push_back(testing::placed(joined.face(f), on_grid.positions));
    }
    std::sort(full.begin(), full.end());
    ProgressiveMesh mesh(asset.head, MeshMemory::live_part);
    mesh.set_index(asset.index);
    for (const auto& [cell, segment] : asset.segments()) {
      ASSERT_TRUE(mesh.add_segment(cell, segment, asset.segment(cell, segment)));
    }
    SourcePolygons kept = polygons_of(asset);
    SeededRandom random(3);
    for (int round = 0; round < 12; ++round) {
      std::vector<CellTarget> targets;
      for (std::uint32_t c = 0; c < asset.index->cells.size(); ++c) {
        if (random.one_in(3)) targets.push_back({c, random.one_in(4) ? random.below(3) : mesh.kEverySegment});
      }
      (void)mesh.move_to(targets);
      SourcePolygons fresh = polygons_of(asset);
      ASSERT_TRUE(fresh.update(mesh));
      ASSERT_TRUE(kept.update(mesh));
      EXPECT_GE(kept.known_count(), fresh.known_count());
      for (const SourcePolygons* polygons : {&fresh, &kept}) {
        const LiveFaces live = live_faces(mesh, polygons);
        for (std::uint32_t f = 0; f < live.faces.face_count(); ++f) {
          if (live.finest[f] == 0) {
            ASSERT_EQ(live.faces.face(f).size(), 3U);
            continue;
          }
          ASSERT_TRUE(
              std::binary_search(full.begin(), full.end(), testing::placed(live.faces.face(f), live.positions)));
        }
      }
    }
  }
}

TEST(SourcePolygons, DamageIsAnErrorAndNeverACrash) {
  const OpenAsset asset =
      built({"", testing::make_torus(20, 12), testing::random_source_faces(testing::make_torus(20, 12), 5, 1)});
  const auto mesh = testing::fully_refined(asset);
  SeededRandom random(7);
  std::size_t found = 0;
  for (int round = 0; round < 2000; ++round) {
    SCOPED_TRACE(round);
    const auto whole = polygon_bytes(asset);
    std::vector<std::byte> bytes(whole.begin(), whole.end());
    if (random.one_in(4)) bytes.resize(random.below(bytes.size() + 1));
    for (std::uint32_t edits = random.below(4); edits > 0 && !bytes.empty(); --edits) {
      bytes[random.below(bytes.size())] = static_cast<std::byte>(random.below(256));
    }
    auto read = SourcePolygons::read(bytes, *asset.head, *asset.index, "asset");
    if (!read) {
      EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
      EXPECT_EQ(read.error().message.rfind("asset: polygons: ", 0), 0U) << read.error().message;
      ++found;
      continue;
    }
    const Result<void> updated = read->update(*mesh);
    if (!updated) ++found;
    EXPECT_TRUE(read->update(*mesh)) << "damage is told once";
    const LiveFaces live = live_faces(*mesh, &*read);
    std::size_t triangles = 0;
    for (std::uint32_t f = 0; f < live.faces.face_count(); ++f) triangles += live.faces.face(f).size() - 2;
    EXPECT_EQ(triangles, live.triangles.size());
  }
  EXPECT_GT(found, 1000U);
}

TEST(SourcePolygons, TheSectionIsTakenAndServedLikeASegment) {
  const OpenAsset asset =
      built({"", testing::make_torus(20, 12), testing::paired_source_faces(testing::make_torus(20, 12))});
  const auto mesh = testing::start(asset);
  const std::uint32_t cell = asset.index->polygon_cell();
  EXPECT_TRUE(mesh->polygon_bytes().empty());
  EXPECT_FALSE(mesh->add_segment(cell, 1, polygon_bytes(asset)));
  EXPECT_FALSE(mesh->add_segment(cell, 0, polygon_bytes(asset).first(3)));
  ASSERT_TRUE(mesh->add_segment(cell, 0, polygon_bytes(asset)));
  EXPECT_TRUE(std::ranges::equal(mesh->polygon_bytes(), polygon_bytes(asset)));
  const auto file = AssetFile::from_memory(asset.bytes, "asset").value();
  EXPECT_EQ(file->cell_count(), cell + 1);
  EXPECT_EQ(file->segment_count(cell), 1U);
  EXPECT_TRUE(std::ranges::equal(file->segment(cell, 0), polygon_bytes(asset)));
  const OpenAsset plain = testing::build_and_open(testing::make_torus(20, 12));
  EXPECT_FALSE(testing::start(plain)->add_segment(plain.index->polygon_cell(), 0, {}));
}

}  // namespace
}  // namespace fanstream
