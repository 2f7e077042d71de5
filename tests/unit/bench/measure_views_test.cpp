#include "tests/bench/measure_views.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/bench/views_report.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/bench/built_asset.h"
#include "tests/unit/bench/written_mesh.h"

namespace fanstream::bench {
namespace {

ViewsOptions fast() {
  ViewsOptions options;
  options.repetitions = 1;
  options.disc_seeds = 2;
  options.face_samples = 2'000;
  options.rms = {5e-3};
  return options;
}

TEST(FirstImage, TakesTwoRoundTripsAndTheHead) {
  const auto asset = built_asset(testing::make_torus(60, 50), small_cells());
  ASSERT_TRUE(asset);
  DracoFile draco;
  draco.bytes.resize(50'000);
  draco.decode_seconds = 0.5;
  const VirtualLinkOptions link = symmetric_link(1.0, 80.0);
  const Result<FirstImage> image = measure_first_image(asset, draco, link, 1);
  ASSERT_TRUE(image) << image.error().message;
  const double head_s = 8e-6 * static_cast<double>(asset->head().size());
  EXPECT_DOUBLE_EQ(image->request_s, 0.08);  // the connection
  EXPECT_GE(image->asked_s(), 0.08 + head_s + image->decode_s);
  EXPECT_LT(image->asked_s(), 0.09 + head_s + image->decode_s);
  EXPECT_DOUBLE_EQ(image->draco.picture_s(), 0.16 + 0.4 + 0.5);
  EXPECT_DOUBLE_EQ(image->draco_asked_s(), 0.08 + 0.4 + 0.5);
  EXPECT_DOUBLE_EQ(image->asked_ratio(), image->asked_s() / image->draco_asked_s());
}

TEST(MeasureViews, FiguresOfARunAddUpAndArePrinted) {
  const testing::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "torus.off";
  write_off(path, testing::make_torus(90, 70));
  ViewsOptions options = fast();
  std::vector<std::string> stages;
  options.progress = [&](std::string_view stage) { stages.emplace_back(stage); };
  const Result<ViewsFigures> f = measure_views(path, options);
  ASSERT_TRUE(f) << f.error().message;
  EXPECT_EQ(f->model, "torus");
  EXPECT_GE(stages.size(), kAllViewsParts.size());
  ASSERT_EQ(f->plain.size(), 4U);
  ASSERT_EQ(f->usual.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LE(f->plain[i].stated_error_px, options.tolerances_px[i]);
    EXPECT_EQ(f->total_bytes(f->plain[i]), f->head_bytes + f->index_bytes + f->plain[i].segment_bytes);
  }
  EXPECT_EQ(f->full_memory->triangles, 12'600U);
  EXPECT_EQ(f->plan_time->cells, f->build.cells);
  for (const ReportFormat format : {ReportFormat::text, ReportFormat::markdown}) {
    EXPECT_NE(print_views({*f}, {"here"}, format).find("torus"), std::string::npos);
  }
  const auto json = nlohmann::json::parse(print_views({*f}, {"here"}, ReportFormat::json));
  EXPECT_EQ(json["view_bytes"].size(), 4U);
  EXPECT_EQ(json["view_bytes"][3]["plain_total_bytes"], f->total_bytes(f->plain[3]));
  EXPECT_EQ(json["forced_share"].size(), 1U);
  EXPECT_EQ(json["close_ups"].size(), 2U);
  EXPECT_EQ(json["rates"].size(), 1U);
  EXPECT_EQ(json["first_image"][0]["head_bytes"], f->head_bytes);
  EXPECT_EQ(json["speed"][0]["splits"], f->moves->splits);
}

TEST(MeasureViews, WhatIsNotAskedForIsNotMeasured) {
  const testing::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "torus.off";
  write_off(path, testing::make_torus(40, 30));
  ViewsOptions options = fast();
  options.position_bits = 10;
  options.parts = {ViewsPart::link};
  const Result<ViewsFigures> f = measure_views(path, options);
  ASSERT_TRUE(f) << f.error().message;
  EXPECT_EQ(f->build.position_bits, 10);
  EXPECT_TRUE(f->image);
  EXPECT_TRUE(f->plain.empty());
  EXPECT_FALSE(!f->close_ups.empty() || f->disc1 || f->rates || f->moves || f->view_memory || f->plan_time);
  const auto json = nlohmann::json::parse(print_views({*f}, {}, ReportFormat::json));
  for (const char* section : {"view_bytes", "forced_share", "close_ups", "rates", "layers", "speed"}) {
    EXPECT_FALSE(json.contains(section)) << section;
  }
  EXPECT_TRUE(json.contains("first_image"));
}

TEST(MeasureViews, AMissingFileIsAnErrorThatNamesIt) {
  const Result<ViewsFigures> f = measure_views("no/such/file.ply", fast());
  ASSERT_FALSE(f);
  EXPECT_EQ(f.error().kind, ErrorKind::not_found);
  EXPECT_NE(f.error().message.find("no/such/file.ply"), std::string::npos);
}

// Limit and verdict of the rows of a figure.
std::vector<std::pair<std::string, std::string>> verdicts(const ViewsFigures& figures, const std::string& figure) {
  const auto json = nlohmann::json::parse(print_views({figures}, {}, ReportFormat::json));
  std::vector<std::pair<std::string, std::string>> found;
  for (const auto& row : json["limits"]) {
    if (row["figure"].get<std::string>().find(figure) == std::string::npos) continue;
    found.emplace_back(row["limit"].is_null() ? "" : row["limit"], row["verdict"].is_null() ? "" : row["verdict"]);
  }
  return found;
}

using Verdicts = std::vector<std::pair<std::string, std::string>>;

TEST(ViewsReport, LimitsGoByTheModelsSize) {
  ViewsFigures figures;
  figures.model = "model";
  figures.build.vertices = kLargeModelVertices;
  figures.draco_bytes = 1000;
  figures.head_bytes = 50;
  figures.index_bytes = 50;
  ViewBytes view;
  view.tolerance_px = 1.0;
  view.segment_bytes = 100;
  figures.plain = figures.usual = {view};
  figures.disc1 = ForcedShare{0.01, 0.03, 0.06};
  figures.disc10 = ForcedShare{0.1, 0.1, 0.1};
  CloseUp close;
  close.in_picture_bytes = 25;
  close.everything_bytes = 100;
  figures.close_ups = {close, close};
  figures.close_ups[1].counted = Counted::facing;
  figures.close_ups[1].in_picture_bytes = 26;
  EXPECT_EQ(verdicts(figures, "bytes to 1 px"), (Verdicts{{"<= 0.3", "pass"}}));
  EXPECT_EQ(verdicts(figures, "disc of 1 %: bytes"), (Verdicts{{"", ""}}));
  figures.build.vertices = kLargeModelVertices + 1;
  EXPECT_EQ(verdicts(figures, "bytes to 1 px"), (Verdicts{{"<= 0.15", "FAIL"}}));
  EXPECT_EQ(verdicts(figures, "disc of 1 %: splits"), (Verdicts{{"<= 4", "pass"}}));
  EXPECT_EQ(verdicts(figures, "disc of 1 %: bytes"), (Verdicts{{"<= 5", "FAIL"}}));
  EXPECT_EQ(verdicts(figures, "/ everything"), (Verdicts{{"<= 0.25", "pass"}, {"<= 0.25", "FAIL"}}));
}

TEST(ViewsReport, TheRateIsLimitedForTheBunnyAlone) {
  ViewsFigures figures;
  figures.rates = RateCurve{{{100, 0.1}}, {{1e-3, 120.0, std::nullopt, 100, 10, 1e-3}}};
  figures.model = "cow";
  EXPECT_EQ(verdicts(figures, "/ peer"), (Verdicts{{"", ""}}));
  figures.model = "stanford_bunny_zipper";
  EXPECT_EQ(verdicts(figures, "/ peer"), (Verdicts{{"<= 1.15", "FAIL"}}));
}

TEST(ViewsReport, NothingMeasuredIsNothingPrinted) {
  EXPECT_EQ(print_views({}, {}, ReportFormat::text), "");
  EXPECT_TRUE(views_sections({}).empty());
}

}  // namespace
}  // namespace fanstream::bench
