#include "client/view/criteria.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/support/projection.h"
#include "tests/support/random_directions.h"
#include "tests/unit/client/view/cell_world.h"

namespace fanstream {
namespace {

using testing::direction_on_rim;
using testing::Projection;
using testing::random_direction;
using testing::random_view;
using testing::SeededRandom;

// In the ball, often on its surface.
glm::dvec3 random_in_ball(SeededRandom& random, const glm::dvec3& center, double radius) {
  return center + random_direction(random) * (radius * (random.one_in(2) ? 1.0 : random.unit()));
}

// Spheres about a place, and points of their convex hull.
struct RandomHull {
  std::vector<ExtentPart> parts;
  CellExtent sphere;  // around all of them

  RandomHull(SeededRandom& random, const CellExtent& about) : sphere(about) {
    parts.resize(1 + random.below(8));
    for (ExtentPart& part : parts) {
      part.center = about.center + random_direction(random) * (about.radius * random.unit());
      part.radius = about.radius * random.unit() * random.unit();
      sphere.radius = std::max(sphere.radius, glm::distance(part.center, about.center) + part.radius);
    }
  }
  glm::dvec3 point(SeededRandom& random) const {
    const auto in_part = [&] {
      const ExtentPart& part = parts[random.below(parts.size())];
      return random_in_ball(random, part.center, part.radius);
    };
    glm::dvec3 p = in_part();
    for (std::uint32_t i = random.below(3); i > 0; --i) p += random.unit() * (in_part() - p);
    return p;
  }
};

CellExtent random_sphere(SeededRandom& random, const View& view) {
  CellExtent bounds;
  const glm::dvec3 ahead = glm::normalize(view.camera.target - view.camera.eye);
  bounds.center = view.camera.eye + (ahead + 1.2 * random.unit() * random_direction(random)) * (4.0 * random.unit());
  bounds.radius = std::pow(10.0, -3.0 * random.unit()) * (random.one_in(4) ? 3.0 : 1.0);
  bounds.cone_axis = random_direction(random);
  bounds.cone_cosine = std::cos(random.unit() * random.unit() * std::numbers::pi);
  return bounds;
}

// Points of a piece, each with another that is drawn for it within an error: how far apart the two are in the picture.
struct PairsOfPoints {
  std::uint64_t count = 0;
  double closest = 0.0;  // to the bound, as a share of it

  void check(const View& view, const CellJudgement& judgement, double error, const std::function<glm::dvec3()>& point,
             SeededRandom& random) {
    const Projection projection(view);
    const double bound = judgement.error.px(error);
    for (int i = 0; i < 60; ++i) {
      const glm::dvec3 there = point();
      const glm::dvec3 drawn = random_in_ball(random, there, error);
      if (!projection.is_drawn(there) || !projection.is_drawn(drawn)) continue;
      if (!projection.in_picture(there) && !projection.in_picture(drawn)) continue;
      ASSERT_TRUE(judgement.in_frustum);
      const double off = glm::distance(projection.pixel(there), projection.pixel(drawn));
      ASSERT_LE(off, bound * (1 + 1e-9)) << "of " << error;
      closest = std::max(closest, off / bound);
      ++count;
    }
  }
};

TEST(Criteria, NoPairOfPointsIsFurtherApartInThePictureThanTheProjectedError) {
  PairsOfPoints pairs;
  for (std::uint64_t seed = 1; seed <= 4000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    View view = random_view(random);
    view.near_distance = std::pow(10.0, -1.0 - 3.0 * random.unit());
    const CellExtent bounds = random_sphere(random, view);
    const double largest = bounds.radius * random.unit() * (random.one_in(3) ? 2.0 : 0.1);
    const double error = largest * random.unit();
    const CellJudgement judgement = ViewJudge(view, {}).judge(bounds, largest);
    const double bound = judgement.error.px(error);
    ASSERT_TRUE(std::isfinite(bound));
    pairs.check(
        view, judgement, error, [&] { return random_in_ball(random, bounds.center, bounds.radius); }, random);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(pairs.count, 20'000U);
  EXPECT_GT(pairs.closest, 0.9) << "the bound is never nearly reached";
}

TEST(Criteria, BoundsHoldForTheConvexHullOfParts) {
  PairsOfPoints pairs;
  for (std::uint64_t seed = 1; seed <= 4000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    View view = random_view(random);
    view.near_distance = std::pow(10.0, -1.0 - 3.0 * random.unit());
    const RandomHull hull(random, random_sphere(random, view));
    const double largest = hull.sphere.radius * random.unit() * (random.one_in(3) ? 2.0 : 0.1);
    const double error = largest * random.unit();
    const ViewJudge judge(view, {});
    const CellJudgement judgement = judge.judge(hull.sphere, largest, hull.parts);
    const double bound = judgement.error.px(error);
    ASSERT_LE(bound, judge.judge(hull.sphere, largest).error.px(error)) << "parts never loosen a bound";
    pairs.check(
        view, judgement, error, [&] { return hull.point(random); }, random);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(pairs.count, 20'000U);
  EXPECT_GT(pairs.closest, 0.9) << "the bound is never nearly reached";
}

TEST(Criteria, PartsTellWhatASphereLeavesOpen) {
  View view;
  view.camera = {{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 60.0};
  view.near_distance = 0.01;
  const ViewJudge judge(view, {});
  const auto row_of_parts = [](const glm::dvec3& from, const glm::dvec3& to) {
    std::vector<ExtentPart> parts;
    for (int i = 0; i <= 4; ++i) parts.push_back({from + 0.25 * i * (to - from), 0.1});
    return parts;
  };
  // A wall across the view is as far away as it is, not nearer by half its width.
  const CellExtent wall{{0, 0, -10}, 4.1};
  const auto across = row_of_parts({-4, 0, -10}, {4, 0, -10});
  EXPECT_NEAR(judge.judge(wall, 0.0).error.depth, 5.9, 1e-12);
  EXPECT_NEAR(judge.judge(wall, 0.0, across).error.depth, 9.9, 1e-12);
  // A beam along the view is no further off its axis at its far end.
  const CellExtent beam{{0, 0, -10}, 4.1};
  EXPECT_LT(judge.judge(beam, 0.0, row_of_parts({0, 0, -6}, {0, 0, -14})).error.scale_px,
            0.95 * judge.judge(beam, 0.0).error.scale_px);
  // A wall beside the frustum, which its sphere touches.
  const CellExtent beside{{9, 0, -10}, 4.1};
  EXPECT_TRUE(judge.judge(beside, 0.0).in_frustum);
  EXPECT_FALSE(judge.judge(beside, 0.0, row_of_parts({9, -4, -10}, {9, 4, -10})).in_frustum);
  // One that stands nearly edge-on: which side it shows is clear along all of it.
  const CellExtent edge_on{{1.5, 0, -10}, 4.1, {1, 0, 0}, 0.9999};
  EXPECT_EQ(judge.judge(edge_on, 0.0).facing, Facing::mixed);
  EXPECT_EQ(judge.judge(edge_on, 0.0, row_of_parts({1.5, 0, -6}, {1.5, 0, -14})).facing, Facing::back);
}

TEST(Criteria, ProjectedErrorOfASmallFarSphereIsNearlyExactAnywhereInThePicture) {
  View view;
  view.camera = {{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 70.0};
  const Projection projection(view);
  for (const glm::dvec3 place : {glm::dvec3(0, 0, -10), glm::dvec3(5, 2, -10), glm::dvec3(9, -6.5, -10)}) {
    const double error = 1e-3;
    const double bound = ViewJudge(view, {}).judge({place, 0.01}, error).error.px(error);
    double worst = 0.0;
    SeededRandom random(3);
    for (int i = 0; i < 20000; ++i) {
      const glm::dvec3 moved = place + error * random_direction(random);
      worst = std::max(worst, glm::distance(projection.pixel(place), projection.pixel(moved)));
    }
    EXPECT_LE(worst, bound);
    EXPECT_GT(worst, 0.98 * bound);
  }
}

TEST(Criteria, ProjectedErrorNeverFallsAsTheErrorRises) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const View view = random_view(random);
    const ProjectedError error = ViewJudge(view, {}).judge(random_sphere(random, view), 1.0).error;
    EXPECT_EQ(error.px(0.0), 0.0);
    double before = 0.0;
    for (double e = 1e-6; e < 10.0; e *= 1.3) {
      EXPECT_GE(error.px(e), before);
      before = error.px(e);
    }
    EXPECT_TRUE(std::isfinite(before));
  }
}

TEST(Criteria, ConesCalledFrontOrBackHoldNoOtherNormals) {
  std::uint64_t fronts = 0, backs = 0, mixed = 0;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const View view = random_view(random);
    const CellExtent bounds = random_sphere(random, view);
    const CellJudgement judgement = ViewJudge(view, {}).judge(bounds, 0.0);
    if (judgement.facing == Facing::mixed) ++mixed;
    if (judgement.facing != Facing::front && judgement.facing != Facing::back) continue;
    const bool back = judgement.facing == Facing::back;
    ++(back ? backs : fronts);
    const double half_angle = std::acos(bounds.cone_cosine);
    for (int i = 0; i < 50; ++i) {
      const glm::dvec3 side = glm::normalize(glm::cross(bounds.cone_axis, random_direction(random)));
      const double angle = half_angle * (random.one_in(2) ? 1.0 : random.unit());
      const glm::dvec3 normal = bounds.cone_axis * std::cos(angle) + side * std::sin(angle);
      const glm::dvec3 point = random_in_ball(random, bounds.center, bounds.radius);
      const double away = glm::dot(normal, point - view.camera.eye);
      ASSERT_TRUE(back ? away > -1e-9 : away < 1e-9) << away;
    }
  }
  EXPECT_GT(fronts, 100U);
  EXPECT_GT(backs, 100U);
  EXPECT_GT(mixed, 100U);
}

TEST(Criteria, ConesCalledFrontOrBackHoldNoOtherNormalsAnywhereInAHull) {
  std::uint64_t known = 0, known_by_parts = 0;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    const View view = random_view(random);
    const RandomHull hull(random, random_sphere(random, view));
    const ViewJudge judge(view, {});
    const Facing facing = judge.judge(hull.sphere, 0.0, hull.parts).facing;
    if (facing != Facing::front && facing != Facing::back) continue;
    ++known;
    if (judge.judge(hull.sphere, 0.0).facing != facing) ++known_by_parts;
    for (int i = 0; i < 50; ++i) {
      const glm::dvec3 normal = direction_on_rim(hull.sphere.cone_axis, hull.sphere.cone_cosine, random);
      const double away = glm::dot(normal, hull.point(random) - view.camera.eye);
      ASSERT_TRUE(facing == Facing::back ? away > -1e-9 : away < 1e-9) << away;
    }
  }
  EXPECT_GT(known, 200U);
  EXPECT_GT(known_by_parts, 20U);
}

TEST(Criteria, FacingIsKnownOnceTheConeAllowsNoDoubt) {
  const View view;  // from (0, 0, 1) to the origin
  const ViewJudge judge(view, {});
  EXPECT_EQ(judge.judge({{0, 0, 0}, 0.1, {0, 0, 1}, 0.9}, 0).facing, Facing::front);
  EXPECT_EQ(judge.judge({{0, 0, 0}, 0.1, {0, 0, -1}, 0.9}, 0).facing, Facing::back);
  EXPECT_EQ(judge.judge({{0, 0, 0}, 0.1, {1, 0, 0}, 0.9}, 0).facing, Facing::mixed);
  EXPECT_EQ(judge.judge({{0, 0, 0}, 0.95, {0, 0, -1}, 0.9}, 0).facing, Facing::mixed) << "the sphere is too near";
  EXPECT_EQ(judge.judge({{0, 0, 0}, 0.1, {0, 0, -1}, 0.0}, 0).facing, Facing::mixed) << "half of all directions";
  EXPECT_EQ(judge.judge({{0, 0, 0}, 0.1}, 0).facing, Facing::unknown);
  EXPECT_TRUE(judge.judge({{0, 0, 0}, 0.1, {1, 0, 0}, 0.9}, 0).can_be_seen());
  EXPECT_FALSE(judge.judge({{0, 0, 0}, 0.1, {0, 0, -1}, 0.9}, 0).can_be_seen());
}

TEST(Criteria, WhatIsOutsideTheFrustumFadesToTheOffscreenWeight) {
  View view;
  view.camera = {{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 90.0};
  view.width_px = view.height_px = 500;
  Criteria criteria;
  criteria.offscreen_weight = 0.125;
  criteria.frustum_falloff = 0.1;
  const auto judged = [&](glm::dvec3 center) { return ViewJudge(view, criteria).judge({center, 0.5}, 0.25); };
  EXPECT_TRUE(judged({10, 0, -10}).in_frustum);
  EXPECT_TRUE(judged({10 + 0.74 * std::sqrt(2.0), 0, -10}).in_frustum) << "the error counts as part of the sphere";
  EXPECT_FALSE(judged({10 + 0.76 * std::sqrt(2.0), 0, -10}).in_frustum);
  EXPECT_EQ(judged({10, 0, -10}).weight, 1.0);
  EXPECT_LT(judged({11.5, 0, -10}).weight, 1.0);
  EXPECT_GT(judged({11.5, 0, -10}).weight, 0.125);
  EXPECT_EQ(judged({20, 0, -10}).weight, 0.125);
  EXPECT_EQ(judged({0, 0, 10}).weight, 0.125) << "behind the eye";
  EXPECT_FALSE(judged({0, 0, 10}).in_frustum);
  criteria.use_frustum = false;
  EXPECT_EQ(judged({0, 0, 10}).weight, 1.0);
  EXPECT_FALSE(judged({0, 0, 10}).in_frustum) << "what is stated is no matter of criteria";
}

TEST(Criteria, SilhouettesWeighMoreAndBackFacesLess) {
  const View view;
  Criteria criteria;
  const auto weight = [&](glm::dvec3 axis) {
    return ViewJudge(view, criteria).judge({{0, 0, 0}, 0.01, axis, 0.99}, 0).weight;
  };
  EXPECT_EQ(weight({0, 0, 1}), 1.0);
  EXPECT_EQ(weight({1, 0, 0}), 2.0);
  EXPECT_EQ(weight({0, 0, -1}), 0.25);
  EXPECT_EQ(ViewJudge(view, criteria).judge({{0, 0, 0}, 0.01, {1, 0, 0}, 0.99}, 0).weight_within, 1.0);
  criteria.use_facing = false;
  EXPECT_EQ(weight({1, 0, 0}), 1.0);
  EXPECT_EQ(weight({0, 0, -1}), 1.0);
}

TEST(Criteria, FocusFallsOffWithDistanceAndAngle) {
  const View view;
  Criteria criteria;
  criteria.use_facing = false;
  criteria.focus_point = FocusPoint{{0, 0, 0}, 0.1, 0.2, 0.5};
  const auto at = [&](double x) { return ViewJudge(view, criteria).judge({{x, 0, 0}, 0.05}, 0).weight; };
  EXPECT_EQ(at(0.0), 1.0);
  EXPECT_EQ(at(0.15), 1.0) << "the sphere touches the focus";
  EXPECT_NEAR(at(0.25), 0.75, 1e-12);
  criteria.use_frustum = false;
  EXPECT_EQ(at(0.4), 0.5);
  EXPECT_EQ(at(40.0), 0.5);

  criteria.focus_point.reset();
  criteria.focus_direction = FocusDirection{{0, 0, 5}, 40.0, 20.0, 0.0};
  const auto turned = [&](double degrees, double half_angle) {
    const double angle = degrees * std::numbers::pi / 180;
    const CellExtent bounds{
        {0, 0, 0}, 0.05, {std::sin(angle), 0, std::cos(angle)}, std::cos(half_angle * std::numbers::pi / 180)};
    return ViewJudge(view, criteria).judge(bounds, 0).weight;
  };
  EXPECT_EQ(turned(0, 10), 1.0);
  EXPECT_EQ(turned(49, 10), 1.0) << "a normal of the cone is within the angle";
  EXPECT_NEAR(turned(60, 10), 0.5, 1e-9);
  EXPECT_EQ(turned(100, 10), 0.0);
  EXPECT_EQ(ViewJudge(view, criteria).judge({{0, 0, 0}, 0.05}, 0).weight, 1.0) << "normals not known";
}

TEST(Criteria, SmallMovesOfTheCameraChangeWeightsLittle) {
  double largest = 0.0;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    View view = random_view(random);
    const CellExtent bounds = random_sphere(random, view);
    const double before = ViewJudge(view, {}).judge(bounds, 0.01).weight;
    const double step = 1e-6 * glm::distance(bounds.center, view.camera.eye);
    view.camera.eye += step * random_direction(random);
    const double change = std::abs(ViewJudge(view, {}).judge(bounds, 0.01).weight - before);
    ASSERT_LT(change, 1e-3);
    largest = std::max(largest, change);
  }
  EXPECT_GT(largest, 0.0);
}

TEST(Criteria, ImpossibleViewsAndCriteriaAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(check_view({}));
  EXPECT_TRUE(check_criteria({}));
  const std::vector<std::function<void(View&)>> views = {[&](View& v) { v.camera.eye.x = nan; },
                                                         [](View& v) { v.camera.eye.y = INFINITY; },
                                                         [](View& v) { v.width_px = 0; },
                                                         [](View& v) { v.height_px = 0; },
                                                         [](View& v) { v.width_px = (1U << 16) + 1; },
                                                         [&](View& v) { v.near_distance = nan; },
                                                         [](View& v) { v.camera.target = v.camera.eye; }};
  for (std::size_t i = 0; i < views.size(); ++i) {
    View view;
    views[i](view);
    const auto checked = check_view(view);
    ASSERT_FALSE(checked) << i;
    EXPECT_EQ(checked.error().kind, ErrorKind::usage);
  }
  const std::vector<std::function<void(Criteria&)>> criteria = {[&](Criteria& c) { c.offscreen_weight = nan; },
                                                                [](Criteria& c) { c.silhouette_weight = -1; },
                                                                [](Criteria& c) { c.back_facing_weight = INFINITY; },
                                                                [&](Criteria& c) {
                                                                  c.focus_point = FocusPoint{{0, nan, 0}};
                                                                },
                                                                [](Criteria& c) {
                                                                  c.focus_point = FocusPoint{{0, 0, 0}, -1};
                                                                },
                                                                [](Criteria& c) {
                                                                  c.focus_direction = FocusDirection{{0, 0, 0}};
                                                                },
                                                                [](Criteria& c) {
                                                                  c.focus_direction = FocusDirection{{0, 0, 1}, -3};
                                                                }};
  for (std::size_t i = 0; i < criteria.size(); ++i) {
    Criteria wrong;
    criteria[i](wrong);
    const auto checked = check_criteria(wrong);
    ASSERT_FALSE(checked) << i;
    EXPECT_EQ(checked.error().kind, ErrorKind::usage);
  }
}

}  // namespace
}  // namespace fanstream
