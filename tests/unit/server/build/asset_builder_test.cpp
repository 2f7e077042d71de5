#include "server/build/asset_builder.h"

#include <gtest/gtest.h>

#include "server/build/layer_plan.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using testing::OpenAsset;

TEST(AssetBuilder, GranularityIsThatOfTheModelsSizeUnlessGiven) {
  const TriangleMesh mesh = testing::make_torus(60, 40);
  const Granularity usual = default_granularity(static_cast<std::uint32_t>(mesh.positions.size()));
  BuildOptions given;
  given.cell_vertices = usual.cell_vertices;
  given.slab_growth = usual.slab_growth;
  given.segment_splits = usual.segment_splits;
  given.edges_per_vertex = usual.edges_per_vertex;
  given.evenness = usual.evenness;
  given.distance_growth = usual.distance_growth;
  given.fine_share = usual.fine_share;
  const auto by_default = build_asset(mesh, {});
  const auto with_given = build_asset(mesh, given);
  ASSERT_TRUE(by_default && with_given);
  EXPECT_EQ(by_default->bytes, with_given->bytes);
  const auto cells_with = [&](auto&& change) {
    BuildOptions options;
    change(options);
    return build_asset(mesh, options).value().report;
  };
  const BuildReport usual_report = by_default->report;
  EXPECT_GT(cells_with([](BuildOptions& o) { o.cell_vertices = 6.0; }).cells, 3 * usual_report.cells);
  EXPECT_GT(cells_with([](BuildOptions& o) { o.slab_growth = 2.0; }).cells, usual_report.cells);
  EXPECT_GT(cells_with([](BuildOptions& o) { o.segment_splits = 3.0; }).segments, usual_report.segments);
  EXPECT_GT(cells_with([](BuildOptions& o) { o.edges_per_vertex = 0.3; }).generations, usual_report.generations);
  EXPECT_GT(cells_with([](BuildOptions& o) { o.distance_growth = 0.8; }).generations, usual_report.generations);
  EXPECT_NE(cells_with([](BuildOptions& o) { o.fine_share = 0.3; }).generations, usual_report.generations);
}

TEST(AssetBuilder, TheReportAddsUpToTheFile) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const auto built = build_asset(mesh, testing::small_cells());
    ASSERT_TRUE(built) << built.error().message;
    const BuildReport& r = built->report;
    EXPECT_EQ(r.total_bytes, built->bytes.size());
    EXPECT_EQ(r.base_bytes + r.split_bytes + r.table_bytes, r.total_bytes);
    EXPECT_EQ(r.base_vertices + r.splits, mesh.positions.size());
    EXPECT_LE(r.generations, kMostGenerations);
    const auto asset = testing::open_asset(built->bytes);
    ASSERT_TRUE(asset) << asset.error().message;
    EXPECT_EQ(r.cells, asset->index->cells.size());
    std::uint64_t segments = 0, split_bytes = 0;
    for (const SegmentEntry& segment : asset->index->segments) {
      segments += segment.size_bytes != 0;
      split_bytes += segment.size_bytes;
    }
    EXPECT_EQ(r.segments, segments);
    EXPECT_EQ(r.split_bytes, split_bytes);
    std::uint64_t pages = 0;
    for (const CellEntry& cell : asset->index->cells) pages += cell.page_bytes;
    EXPECT_EQ(split_bytes + pages + range_table_bytes(*asset->head, *asset->index), asset->preamble.segment_bytes);
    const std::span<const std::byte> sections =
        std::span<const std::byte>(built->bytes).first(asset->preamble.section_bytes());
    EXPECT_EQ(assemble_file(asset->preamble, sections.subspan(kPreambleBytes)), built->bytes);
  }
}

TEST(AssetBuilder, BoundsNeverRiseTowardsTheFine) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const OpenAsset asset = testing::build_and_open(mesh);
    ASSERT_TRUE(asset.index);
    const auto code = [&](const CellEntry& cell, std::uint32_t segment) {
      return asset.index->segments[cell.first_segment + segment].error_code;
    };
    for (const CellEntry& cell : asset.index->cells) {
      for (std::uint32_t s = 1; s < cell.segment_count; ++s) ASSERT_LE(code(cell, s), code(cell, s - 1));
      if (cell.slab == 0) continue;
      const CellEntry& parent = asset.index->cells[cell.parent];
      ASSERT_LE(code(cell, 0), code(parent, parent.segment_count - 1));
    }
  }
}

}  // namespace
}  // namespace fanstream
