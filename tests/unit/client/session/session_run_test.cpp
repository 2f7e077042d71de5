#include "client/session/session_run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "client/model/segment_order.h"
#include "client/session/built_in_paths.h"
#include "client/session/simulated_connection.h"
#include "common/asset/asset_file.h"
#include "common/fans/fan_cover.h"
#include "common/fans/fan_shape.h"
#include "common/refine/full_mesh.h"
#include "tests/support/small_assets.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using testing::TemporaryFolder;
namespace fs = std::filesystem;

// Streams the whole model coarse to fine, whatever is looked at, over a simulated link. Real in all but its stated
// error, which is the share of vertices that are missing.
class WholeModelSession final : public ViewSession {
 public:
  explicit WholeModelSession(std::shared_ptr<const AssetFile> asset, double rate_mbit_s = 0.2)
      : asset_(asset), connection_(asset, options_for(rate_mbit_s)), mesh_(asset->asset_head()) {
    connection_.open("model");
  }

  Result<SessionStep> step(const PathView& view, double time_s) override {
    views.push_back(view);
    if (fail_at_s && time_s >= *fail_at_s) return fail(ErrorKind::network, "the server is gone");
    if (late_s > 0.0) time_s += late_s;
    const Result<void> ran =
        connection_.run_until(std::llround(time_s * 1e6), [this](const ClientEvent& event, TimeUs now_us) {
          if (std::holds_alternative<event::HeadComplete>(event))
            first_ = FirstImage{now_us * 1e-6, connection_.received_bytes()};
          if (std::holds_alternative<event::IndexComplete>(event)) {
            mesh_.set_index(asset_->asset_index());
            const std::vector<OrderedSegment> order = order_segments(mesh_.head(), mesh_.index());
            EXPECT_TRUE(connection_.set_segment_table(segment_table(mesh_.index())));
            EXPECT_TRUE(connection_.set_wants(wants_for(order, order.size())));
          }
          if (const auto* segment = std::get_if<event::SegmentArrived>(&event)) {
            EXPECT_TRUE(mesh_.add_segment(segment->cell, segment->segment, segment->bytes));
            segment_bytes_ += segment->bytes.size();
          }
        });
    if (!ran) return tl::unexpected(ran.error());
    SessionStep step;
    if (mesh_.has_index()) step.splits_applied = mesh_.refine().value();
    step.time_s = time_s;
    step.received_bytes = connection_.received_bytes();
    step.segment_bytes = segment_bytes_;
    step.segments = connection_.client().received_segments();
    if (first_) {
      step.triangles = mesh_.triangle_mesh().triangles.size();
      step.error_px = 20.0 * (1.0 - static_cast<double>(mesh_.vertex_count()) / mesh_.head().vertex_count);
    }
    step.tolerance_px = view.tolerance_px;
    step.state = mesh_.is_complete() ? ViewState::complete : ViewState::progressing;
    return step;
  }
  double now_s() const override { return static_cast<double>(connection_.now_us()) * 1e-6; }
  Result<FanMesh> fan_mesh() override { return first_ ? make_fan_mesh(mesh_.triangle_mesh()) : FanMesh(); }
  std::optional<FirstImage> first_image() const override { return first_; }

  std::vector<PathView> views;
  std::optional<double> fail_at_s;
  double late_s = 0.0;  // every step takes so much longer

 private:
  static SimulatedConnectionOptions options_for(double rate_mbit_s) {
    SimulatedConnectionOptions options;
    options.link = symmetric_link(rate_mbit_s, 50.0);
    return options;
  }

  std::shared_ptr<const AssetFile> asset_;
  SimulatedConnection connection_;
  ProgressiveMesh mesh_;
  std::optional<FirstImage> first_;
  std::uint64_t segment_bytes_ = 0;
};

std::shared_ptr<const AssetFile> torus() {
  static const auto asset = AssetFile::from_memory(testing::small_asset(), "torus").value();
  return asset;
}

CameraPath small_path(std::string_view name = "orbit", double fps = 2.0) {
  BuiltInPathOptions options;
  options.width = 96;
  options.height = 64;
  options.fps = fps;
  CameraPath path = *built_in_path(name, {{-1.35, -1.35, -0.35}, {1.35, 1.35, 0.35}}, options);
  return path;
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

SessionRunOptions into(const fs::path& folder) {
  SessionRunOptions options;
  options.folder = folder;
  options.header.model = "torus";
  options.header.path = "orbit";
  return options;
}

TEST(SessionRun, WritesEverythingAboutAPathPlayedToItsEnd) {
  const TemporaryFolder folder;
  WholeModelSession session(torus(), 0.01);
  const FanMesh full = make_fan_mesh(load_full(*torus()).value()->triangle_mesh()).value();
  SessionRunOptions options = into(folder.path() / "out");
  options.full_model = &full;
  options.draco = PeerDownload{1000, 0.3, 0.01};
  const CameraPath path = small_path();
  const Result<SessionRunReport> report = run_session(session, path, options);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(report->ended_early);
  ASSERT_EQ(report->frames.size(), frame_count(path));
  EXPECT_EQ(names_in(options.folder),
            (std::set<std::string>{"frames", "animation.png", "contact_sheet.png", "frames.csv", "session.json",
                                   "error_by_bytes.png", "error_by_time.png"}));
  EXPECT_EQ(names_in(options.folder / "frames").size(), report->frames.size());
  EXPECT_EQ(text_of(options.folder / "frames.csv"), to_csv(report->frames));
  const nlohmann::json json = nlohmann::json::parse(text_of(options.folder / "session.json"));
  EXPECT_EQ(json["frames"].size(), report->frames.size());
  // The model comes in, and what is drawn ends as the full model itself.
  EXPECT_EQ(report->frames.front().triangles, 0U);
  EXPECT_EQ(report->frames.front().issued_vertices, 0U);
  EXPECT_EQ(report->frames.back().issued_vertices, fan_statistics(full.vertices.size(), full).issued_vertices);
  EXPECT_EQ(report->frames.back().triangles, torus()->triangle_count());
  EXPECT_EQ(report->frames.back().difference->differing_share, 0.0);
  const auto coarse = std::find_if(report->frames.begin(), report->frames.end(), [](const FrameRecord& frame) {
    return frame.triangles > 0 && frame.triangles < torus()->triangle_count();
  });
  ASSERT_NE(coarse, report->frames.end());
  EXPECT_GT(coarse->difference->differing_share, 0.0);
  EXPECT_LT(coarse->difference->psnr_db, 60.0);
  EXPECT_EQ(report->summary.end_state, ViewState::complete);
  EXPECT_EQ(report->summary.first_image_s, session.first_image()->time_s);
  EXPECT_TRUE(report->summary.shots.at(0).reached[3]);
}

TEST(SessionRun, AFrameThatCannotBeWrittenEndsItWithTablesOfThoseBefore) {
  const TemporaryFolder folder;
  WholeModelSession session(torus());
  SessionRunOptions options = into(folder.path());
  const fs::path in_the_way = folder.path() / "frames" / "frame_00003.png";
  options.progress = [&](std::string_view, double) { fs::create_directories(in_the_way); };
  const Result<SessionRunReport> report = run_session(session, small_path(), options);
  ASSERT_TRUE(report) << report.error().message;
  ASSERT_TRUE(report->ended_early);
  EXPECT_EQ(report->ended_early->kind, ErrorKind::io);
  EXPECT_NE(report->ended_early->message.find("frame_00003.png"), std::string::npos) << report->ended_early->message;
  EXPECT_EQ(report->frames.size(), 3U);
  EXPECT_EQ(text_of(folder.path() / "frames.csv"), to_csv(report->frames));
  EXPECT_TRUE(fs::exists(folder.path() / "session.json"));
}

TEST(SessionRun, PlayedTwiceGivesTheSameNumbersAndPictures) {
  std::vector<std::string> tables, animations;
  for (int i = 0; i < 2; ++i) {
    const TemporaryFolder folder;
    WholeModelSession session(torus());
    Result<SessionRunReport> report = run_session(session, small_path("jump"), into(folder.path()));
    ASSERT_TRUE(report) << report.error().message;
    for (FrameRecord& frame : report->frames) frame.draw_ms = 0.0;  // the only one that is measured here
    tables.push_back(to_csv(report->frames));
    animations.push_back(text_of(folder.path() / "animation.png"));
  }
  EXPECT_EQ(tables[0], tables[1]);
  EXPECT_EQ(animations[0], animations[1]);
}

TEST(SessionRun, DrawsAStillSceneOnce) {
  const TemporaryFolder folder;
  WholeModelSession session(torus(), 100.0);
  const Result<SessionRunReport> report = run_session(session, small_path("jump"), into(folder.path()));
  ASSERT_TRUE(report) << report.error().message;
  std::size_t drawn = 0;
  std::size_t cuts = 0;
  for (const FrameRecord& frame : report->frames) {
    drawn += frame.draw_ms > 0.0 ? 1 : 0;
    cuts += frame.cut ? 1 : 0;
  }
  EXPECT_EQ(cuts, 1U);
  EXPECT_LE(drawn, 4U);  // nothing, all, and all from the other side; perhaps FM0
  EXPECT_EQ(names_in(folder.path() / "frames").size(), report->frames.size());
}

TEST(SessionRun, WithoutPicturesWritesTablesAndPlots) {
  const TemporaryFolder folder;
  WholeModelSession session(torus());
  SessionRunOptions options = into(folder.path());
  options.pictures = false;
  const Result<SessionRunReport> report = run_session(session, small_path(), options);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(names_in(folder.path()),
            (std::set<std::string>{"frames.csv", "session.json", "error_by_bytes.png", "error_by_time.png"}));
  EXPECT_FALSE(report->frames.back().difference);
}

TEST(SessionRun, WhatEndsItKeepsTheFramesBefore) {
  for (const bool interrupted : {false, true}) {
    const TemporaryFolder folder;
    WholeModelSession session(torus());
    SessionRunOptions options = into(folder.path());
    int left = 7;
    if (interrupted) {
      options.go_on = [&left]() -> Result<void> {
        if (left-- == 0) return fail(ErrorKind::interrupted, "stopped by the user");
        return {};
      };
    } else {
      session.fail_at_s = 1.3;  // frame 7 at 5 a second
    }
    const Result<SessionRunReport> report = run_session(session, small_path("orbit", 5.0), options);
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_TRUE(report->ended_early);
    EXPECT_EQ(report->ended_early->kind, interrupted ? ErrorKind::interrupted : ErrorKind::network);
    EXPECT_EQ(report->frames.size(), 7U);
    EXPECT_EQ(names_in(folder.path() / "frames").size(), 7U);
    EXPECT_TRUE(fs::exists(folder.path() / "animation.png"));
    EXPECT_TRUE(fs::exists(folder.path() / "session.json"));
  }
}

TEST(SessionRun, WhatEndsItBeforeTheFirstFrameIsItsError) {
  const TemporaryFolder folder;
  WholeModelSession session(torus());
  session.fail_at_s = 0.0;
  const Result<SessionRunReport> report = run_session(session, small_path(), into(folder.path()));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().message, "the server is gone");
  EXPECT_FALSE(fs::exists(folder.path() / "session.json"));
}

// A step that takes 0.5 s lets two of three frames at 5 a second pass.
TEST(SessionRun, InRealTimeLeavesOutFramesWhoseTimeHasPassed) {
  const TemporaryFolder folder;
  WholeModelSession session(torus());
  session.late_s = 0.5;
  SessionRunOptions options = into(folder.path());
  options.real_time = true;
  const Result<SessionRunReport> report = run_session(session, small_path("orbit", 5.0), options);
  ASSERT_TRUE(report) << report.error().message;
  for (std::size_t i = 0; i < report->frames.size(); ++i) EXPECT_EQ(report->frames[i].frame, 3 * i);
}

TEST(SessionRun, RemovesFramesOfAnEarlierRunAndNothingElse) {
  const TemporaryFolder folder;
  folder.write("frames/frame_00999.png", "old");
  folder.write("frames/frame_mine.png", "mine");
  folder.write("frames/frame_00001.png.txt", "mine");
  folder.write("notes.txt", "mine");
  WholeModelSession session(torus());
  ASSERT_TRUE(run_session(session, small_path(), into(folder.path())));
  const std::set<std::string> frames = names_in(folder.path() / "frames");
  EXPECT_EQ(frames.count("frame_00999.png"), 0U);
  EXPECT_EQ(frames.count("frame_mine.png"), 1U);
  EXPECT_EQ(frames.count("frame_00001.png.txt"), 1U);
  EXPECT_EQ(text_of(folder.path() / "notes.txt"), "mine");
}

TEST(SessionRun, SaysWhereItCannotWrite) {
  const TemporaryFolder folder;
  folder.write("file", "");
  WholeModelSession session(torus());
  for (const fs::path& place : {folder.path() / "none" / "out", folder.path() / "file"}) {
    const Result<SessionRunReport> report = run_session(session, small_path(), into(place));
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().kind, ErrorKind::io);
    EXPECT_NE(report.error().message.find(place.string()), std::string::npos) << report.error().message;
  }
}

}  // namespace
}  // namespace fanstream
