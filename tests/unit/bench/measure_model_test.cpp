#include "tests/bench/measure_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/bench/load_measure.h"
#include "tests/bench/model_report.h"
#include "tests/bench/train_statistics.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/bench/built_asset.h"
#include "tests/unit/bench/written_mesh.h"

namespace fanstream::bench {
namespace {

MeasureOptions fast() {
  MeasureOptions options;
  options.repetitions = 1;
  options.disc_seeds = 2;
  options.face_samples = 2'000;
  return options;
}

TEST(SameTriangles, NumberingAndOrderDoNotMatterButWindingDoes) {
  const GridMesh mesh = on_grid(testing::make_torus(12, 9), 10);
  EXPECT_TRUE(same_triangles(mesh, on_grid(testing::shuffled(testing::make_torus(12, 9), 4), 10)));
  GridMesh flipped = mesh;
  std::swap(flipped.triangles[5][0], flipped.triangles[5][1]);
  EXPECT_FALSE(same_triangles(mesh, flipped));
  GridMesh moved = mesh;
  ++moved.positions[7][2];
  EXPECT_FALSE(same_triangles(mesh, moved));
}

TEST(MeasureModel, FiguresOfARunAddUp) {
  const testing::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "torus.off";
  write_off(path, testing::make_torus(50, 40));
  const Result<ModelFigures> f = measure_model(path, fast());
  ASSERT_TRUE(f) << f.error().message;
  EXPECT_EQ(f->model, "torus");
  EXPECT_EQ(f->build.vertices, 2000U);
  EXPECT_EQ(f->build.triangles, 4000U);
  EXPECT_EQ(f->build.total_bytes, f->build.base_bytes + f->build.split_bytes + f->build.table_bytes);
  EXPECT_FALSE(f->regular_height_field);
  EXPECT_GT(f->decode_seconds, 0.0);
  EXPECT_GT(f->peak_memory_bytes, 1'000'000U);
  EXPECT_DOUBLE_EQ(f->base_limit(), 404.0);
  EXPECT_GE(f->issued_per_vertex, 2.0);
  EXPECT_LT(f->issued_per_vertex, 4.0);
  ASSERT_GE(f->levels.size(), 3U);
  EXPECT_EQ(f->levels[0].vertices, 1000U);
  for (const ReportFormat format : {ReportFormat::text, ReportFormat::markdown}) {
    EXPECT_NE(print_report({*f}, {"here"}, format).find("torus"), std::string::npos);
  }
  const auto json = nlohmann::json::parse(print_report({*f}, {"here"}, ReportFormat::json));
  EXPECT_EQ(json["sizes"][0]["total_bytes"], f->build.total_bytes);
  EXPECT_EQ(json["limits"].size(), 17U);
  EXPECT_EQ(json["limits"][0]["verdict"], "pass");
  EXPECT_EQ(json["limits"][0]["measured"], f->build.base_vertices);
}

TEST(MeasureModel, ALatticeOfHeightsIsARegularHeightField) {
  EXPECT_TRUE(is_regular_height_field(testing::make_terrain(60, 50, 1)));
  EXPECT_FALSE(is_regular_height_field(testing::make_sphere(40, 50)));
  EXPECT_FALSE(is_regular_height_field(testing::make_torus(40, 50)));  // as regular, but closed
}

TEST(MeasureModel, AMissingFileIsAnErrorThatNamesIt) {
  const Result<ModelFigures> f = measure_model("no/such/file.ply", fast());
  ASSERT_FALSE(f);
  EXPECT_EQ(f.error().kind, ErrorKind::not_found);
  EXPECT_NE(f.error().message.find("no/such/file.ply"), std::string::npos);
}

TEST(ModelReport, GeometricMeanLeavesOutWhatIsNotAPositiveNumber) {
  EXPECT_DOUBLE_EQ(geometric_mean({2.0, 8.0}), 4.0);
  EXPECT_DOUBLE_EQ(geometric_mean({2.0, 0.0, HUGE_VAL, 8.0}), 4.0);
  EXPECT_EQ(geometric_mean({}), 0.0);
  EXPECT_EQ(print_report({}, {}, ReportFormat::text), "");
}

std::string without_comments_and_blanks(std::istream& in) {
  std::string text;
  for (std::string line; std::getline(in, line);) {
    if (line.compare(0, 2, "//") == 0) continue;
    std::copy_if(line.begin(), line.end(), std::back_inserter(text), [](unsigned char c) { return !std::isspace(c); });
  }
  return text;
}

TEST(TrainStatistics, TheBuiltInStatisticsArePrintedAsTheyStandInTheSource) {
  std::ifstream file(FANSTREAM_SOURCE_DIR "/common/coding/default_statistics.inc");
  ASSERT_TRUE(file);
  std::istringstream printed(statistics_source(TrainedStatistics::built_in(), "a comment"));
  EXPECT_EQ(without_comments_and_blanks(printed), without_comments_and_blanks(file));
}

TEST(TrainStatistics, LearningReplacesWhatTheCorpusShows) {
  StatisticsTraining training;
  ASSERT_TRUE(training.add(testing::make_terrain(60, 50, 2), 12));
  const TrainedStatistics trained = training.learn();
  EXPECT_NE(trained.tables, TrainedStatistics::built_in().tables);
  const SplitStatistics& learnt = trained.statistics;
  EXPECT_NE(learnt.symbols, SplitStatistics::built_in().symbols);
  EXPECT_NE(learnt.weights, SplitStatistics::built_in().weights);
  EXPECT_NE(learnt.spreads, SplitStatistics::built_in().spreads);
}

TEST(LoadMeasure, EveryClientGetsTheAssetExactly) {
  const std::shared_ptr<const OpenAsset> asset = built_asset(testing::make_torus(40, 30), small_cells());
  ASSERT_TRUE(asset);
  const Result<LoadMeasurement> measured = measure_load(asset, 12);
  ASSERT_TRUE(measured) << measured.error().message;
  EXPECT_TRUE(measured->exact);
  EXPECT_EQ(measured->report.complete, 12U);
  EXPECT_GE(measured->server_sent_bytes, 12 * asset->size_bytes());
}

}  // namespace
}  // namespace fanstream::bench
