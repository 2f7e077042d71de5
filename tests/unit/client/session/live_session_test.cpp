#include "client/session/live_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "client/session/built_in_paths.h"
#include "common/asset/asset_file.h"
#include "common/fans/fan_shape.h"
#include "common/geometry/triangle_tree.h"
#include "common/refine/full_mesh.h"
#include "tests/support/projection.h"
#include "tests/support/seeded_random.h"
#include "tests/support/small_assets.h"

namespace fanstream {
namespace {

// Rough all over, so that a close view of one side needs much that another does not.
const TriangleMesh& mesh() {
  static const TriangleMesh ball = [] {
    TriangleMesh rough = testing::make_sphere(120, 160);
    testing::SeededRandom random(1);
    for (glm::dvec3& p : rough.positions) p *= 1.0 + 0.02 * random.unit();
    return rough;
  }();
  return ball;
}

std::shared_ptr<const AssetFile> ball() {
  static const auto asset = AssetFile::from_memory(testing::small_asset(mesh()), "ball").value();
  return asset;
}

CameraPath path_of(std::string_view name, double fps, double tolerance_px = 1.0) {
  BuiltInPathOptions options;
  options.width = 640;
  options.height = 480;
  options.fps = fps;
  options.tolerance_px = tolerance_px;
  return *built_in_path(name, bounds_of(mesh().positions), options);
}

std::unique_ptr<ViewSession> session(double rate_mbit_s, const CameraPath& path,
                                     std::optional<std::uint64_t> triangle_budget = {}) {
  SessionSettings settings;
  settings.width = path.width;
  settings.height = path.height;
  settings.triangle_budget = triangle_budget;
  return live_session(simulated_transport(ball(), symmetric_link(rate_mbit_s, 50.0), "ball"), settings);
}

std::vector<SessionStep> play(ViewSession& session, const CameraPath& path) {
  std::vector<SessionStep> steps;
  for (std::size_t frame = 0; frame < frame_count(path); ++frame) {
    const double time_s = frame_time_s(path, frame);
    const Result<SessionStep> step = session.step(view_at(path, time_s), time_s);
    EXPECT_TRUE(step) << step.error().message;
    if (!step) return steps;
    steps.push_back(*step);
  }
  return steps;
}

// What counts up never falls, and nothing is known before there is something.
void expect_sensible(const std::vector<SessionStep>& steps) {
  for (std::size_t i = 1; i < steps.size(); ++i) {
    EXPECT_GT(steps[i].time_s, steps[i - 1].time_s);
    EXPECT_GE(steps[i].received_bytes, steps[i - 1].received_bytes);
    EXPECT_GE(steps[i].segment_bytes, steps[i - 1].segment_bytes);
    EXPECT_GE(steps[i].segments, steps[i - 1].segments);
    EXPECT_GE(steps[i].stale_bytes, steps[i - 1].stale_bytes);
    if (steps[i - 1].triangles != 0) {
      EXPECT_EQ(steps[i].triangles + 2 * steps[i].splits_undone, steps[i - 1].triangles + 2 * steps[i].splits_applied);
    }
    EXPECT_LE(steps[i].stale_bytes, steps[i].segment_bytes);
    EXPECT_LE(steps[i].segment_bytes, steps[i].received_bytes);
  }
}

TEST(LiveSession, AStillCameraIsCompleteWithinItsToleranceAndThenCostsNothing) {
  CameraPath path = path_of("orbit", 10.0);
  path.keyframes.resize(1);
  const auto live = session(2.0, path);
  const PathView view = view_at(path, 0.0);
  EXPECT_FALSE(live->first_image());
  std::optional<SessionStep> complete;
  for (int frame = 0; frame < 200; ++frame) {
    const Result<SessionStep> step = live->step(view, 0.1 * frame);
    ASSERT_TRUE(step) << step.error().message;
    if (complete) {
      EXPECT_EQ(step->state, ViewState::complete);
      EXPECT_EQ(step->segments, complete->segments);
      EXPECT_EQ(step->splits_applied + step->splits_undone, 0U);
    } else if (step->state == ViewState::complete) {
      complete = *step;
    }
  }
  ASSERT_TRUE(complete);
  ASSERT_TRUE(complete->error_px);
  EXPECT_LE(*complete->error_px, view.tolerance_px);
  EXPECT_GT(complete->segments, 0U);
  // Nobody has changed his mind, but of what was wanted on suspicion some turns out not to be needed.
  EXPECT_LE(complete->stale_bytes, complete->segment_bytes / 10);
  ASSERT_TRUE(live->first_image());
  EXPECT_LT(live->first_image()->time_s, complete->time_s);
  EXPECT_GE(live->first_image()->received_bytes, ball()->head().size());
  const Result<FanMesh> drawn = live->fan_mesh();
  ASSERT_TRUE(drawn);
  EXPECT_FALSE(drawn->fans.empty());
}

TEST(LiveSession, AnOrbitIsTheSameEveryTimeAndEndsComplete) {
  const CameraPath path = path_of("orbit", 5.0);
  std::vector<SessionStep> runs[2];
  for (std::vector<SessionStep>& steps : runs) {
    const auto live = session(5.0, path);
    steps = play(*live, path);
    ASSERT_EQ(steps.size(), frame_count(path));
    expect_sensible(steps);
    EXPECT_EQ(steps.back().state, ViewState::complete);
    EXPECT_LE(steps.back().error_px.value(), steps.back().tolerance_px);
  }
  for (std::size_t i = 0; i < runs[0].size(); ++i) {
    EXPECT_EQ(runs[0][i].received_bytes, runs[1][i].received_bytes);
    EXPECT_EQ(runs[0][i].triangles, runs[1][i].triangles);
    EXPECT_EQ(runs[0][i].error_px, runs[1][i].error_px);
  }
}

// Over a link so slow that a first view is not done when the second comes.
TEST(LiveSession, AJumpIsFollowedAndWhatItMakesUselessIsCounted) {
  constexpr double kTolerancePx = 10.0;
  const CameraPath path = path_of("jump", 10.0, kTolerancePx);
  const auto live = session(0.04, path);
  const std::vector<SessionStep> steps = play(*live, path);
  ASSERT_EQ(steps.size(), frame_count(path));
  expect_sensible(steps);
  const auto cut = std::find_if(path.keyframes.begin(), path.keyframes.end(), [](const auto& key) { return key.cut; });
  ASSERT_NE(cut, path.keyframes.end());
  const auto frame = static_cast<std::size_t>(cut->time_s * path.fps + 1e-6);
  const SessionStep& before = steps[frame - 1];
  EXPECT_EQ(before.state, ViewState::progressing);
  EXPECT_GT(steps.back().stale_bytes, before.stale_bytes);
  EXPECT_GT(steps.back().segment_bytes - before.segment_bytes, 2 * (steps.back().stale_bytes - before.stale_bytes))
      << "most of what comes is of use";
  EXPECT_EQ(steps[frame].state, ViewState::progressing);
  EXPECT_GT(steps[frame].error_px.value(), kTolerancePx);
  EXPECT_EQ(steps.back().state, ViewState::complete);
  EXPECT_LE(steps.back().error_px.value(), kTolerancePx);
}

TEST(LiveSession, WhatAViewNeedsIsAskedForWhenItIsSeenAndNotBefore) {
  const CameraPath path = path_of("jump", 5.0, 40.0);
  const auto live = session(20.0, path);
  const auto step = [&](const PathView& view, double time_s) { return live->step(view, time_s).value(); };
  SessionStep before;
  for (int frame = 0; frame < 20; ++frame) before = step(view_at(path, 0.0), 0.2 * frame);
  ASSERT_EQ(before.state, ViewState::complete);
  const auto cut = std::find_if(path.keyframes.begin(), path.keyframes.end(), [](const auto& key) { return key.cut; });
  ASSERT_NE(cut, path.keyframes.end());
  PathView after = view_at(path, cut->time_s);
  after.tolerance_px = 1.0;
  const SessionStep seen = step(after, 10.0);
  EXPECT_EQ(seen.received_bytes, before.received_bytes) << "nobody knew of it in the six seconds before";
  EXPECT_EQ(seen.state, ViewState::progressing);
  EXPECT_EQ(step(after, 10.049).received_bytes, before.received_bytes) << "less than a round trip later";
  const SessionStep later = step(after, 12.0);
  EXPECT_GT(later.received_bytes, before.received_bytes);
  EXPECT_EQ(later.state, ViewState::complete);
}

// FM0 cuts off what sticks out: the nearest of it is nearer to the eye than anything of FM0.
TEST(LiveSession, TheStatedErrorHoldsForWhatComesNearerThanTheCoarsestMesh) {
  constexpr double kGap = 0.01;
  const TriangleMesh full = load_full(*ball()).value()->triangle_mesh();
  const glm::dvec3 tip = *std::max_element(full.positions.begin(), full.positions.end(),
                                           [](const glm::dvec3& a, const glm::dvec3& b) { return a.z < b.z; });
  CameraPath path = path_of("orbit", 10.0, 100.0);
  path.keyframes.resize(1);
  Camera& camera = path.keyframes[0].camera;
  camera = {tip + glm::dvec3(0, 0, kGap), tip, {0, 1, 0}, 45.0};
  const auto live = session(20.0, path);
  SessionStep step;
  for (int frame = 0; frame < 20; ++frame) step = live->step(view_at(path, 0.0), 0.1 * frame).value();
  ASSERT_TRUE(step.error_px);
  const FanMesh shown = live->fan_mesh().value();
  TriangleMesh drawn{{}, triangles_of(shown)};
  for (const Vertex& v : shown.vertices) drawn.positions.emplace_back(v.point);
  const TriangleTree tree = TriangleTree::build(drawn).value();
  const View view{camera, path.width, path.height, depth_range(camera, bounds_of(full.positions)).near_distance};
  const testing::Projection projection(view);
  double farthest = 0.0;
  for (const glm::dvec3& p : full.positions) {
    if (!projection.is_drawn(p) || !projection.in_picture(p)) continue;
    const glm::dvec3 is = tree.closest(p).position;
    if (projection.is_drawn(is))
      farthest = std::max(farthest, glm::distance(projection.pixel(is), projection.pixel(p)));
  }
  EXPECT_GT(farthest, 1.0);
  EXPECT_LE(farthest, *step.error_px);
}

TEST(LiveSession, ATriangleBudgetIsKeptAndSaid) {
  const CameraPath path = path_of("orbit", 2.0);
  const auto live = session(20.0, path, 3000);
  const std::vector<SessionStep> steps = play(*live, path);
  ASSERT_EQ(steps.size(), frame_count(path));
  bool degraded = false;
  for (const SessionStep& step : steps) {
    EXPECT_LE(step.triangles, 3000U + 3000U / 5);
    if (step.state != ViewState::degraded) continue;
    degraded = true;
    EXPECT_NE(step.reason, "");
    EXPECT_GT(step.tolerance_px, 1.0);
  }
  EXPECT_TRUE(degraded);
}

// A server that says it has sent what it has not ends the session; it would be waited for without end.
TEST(LiveSession, AServerThatLacksASegmentIsAnError) {
  class Lacking final : public SegmentSource {
   public:
    Digest digest() const override { return ball()->digest(); }
    std::span<const std::byte> head() const override { return ball()->head(); }
    std::span<const std::byte> index() const override { return ball()->index(); }
    std::uint32_t cell_count() const override { return ball()->cell_count(); }
    std::uint32_t segment_count(std::uint32_t cell) const override { return ball()->segment_count(cell); }
    std::span<const std::byte> segment(std::uint32_t cell, std::uint32_t segment) const override {
      return cell == 0 && segment == 0 ? std::span<const std::byte>() : ball()->segment(cell, segment);
    }
    std::uint64_t vertex_count() const override { return ball()->vertex_count(); }
    std::uint64_t triangle_count() const override { return ball()->triangle_count(); }
    std::uint64_t size_bytes() const override { return ball()->size_bytes(); }
  };
  const CameraPath path = path_of("orbit", 2.0);
  const auto live =
      live_session(simulated_transport(std::make_shared<Lacking>(), symmetric_link(5.0, 50.0), "lacking"), {});
  const Result<SessionStep> step = live->step(view_at(path, 0.0), 20.0);
  ASSERT_FALSE(step);
  EXPECT_EQ(step.error().kind, ErrorKind::bad_input);
}

// A server whose bytes are not an asset ends the session with its name.
TEST(LiveSession, AHeadThatCannotBeReadIsAnError) {
  class Nonsense final : public SegmentSource {
   public:
    Digest digest() const override { return {}; }
    std::span<const std::byte> head() const override { return bytes_; }
    std::span<const std::byte> index() const override { return {}; }
    std::uint32_t cell_count() const override { return 0; }
    std::uint32_t segment_count(std::uint32_t /*cell*/) const override { return 0; }
    std::span<const std::byte> segment(std::uint32_t /*cell*/, std::uint32_t /*segment*/) const override { return {}; }
    std::uint64_t vertex_count() const override { return 3; }
    std::uint64_t triangle_count() const override { return 1; }
    std::uint64_t size_bytes() const override { return bytes_.size(); }

   private:
    std::vector<std::byte> bytes_{1000, std::byte{42}};
  };
  const CameraPath path = path_of("orbit", 2.0);
  const auto live =
      live_session(simulated_transport(std::make_shared<Nonsense>(), symmetric_link(5.0, 50.0), "nonsense"), {});
  const Result<SessionStep> step = live->step(view_at(path, 0.0), 5.0);
  ASSERT_FALSE(step);
  EXPECT_EQ(step.error().kind, ErrorKind::bad_input);
  EXPECT_TRUE(step.error().message.starts_with("nonsense: ")) << step.error().message;
}

}  // namespace
}  // namespace fanstream
