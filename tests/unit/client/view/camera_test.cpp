#include "client/view/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

namespace fanstream {
namespace {

// Where a point appears: -1 to 1 across the picture, and the depth within the range likewise.
glm::dvec3 project(const Camera& camera, double aspect, const Bounds& bounds, const glm::dvec3& point) {
  const glm::dvec4 clip =
      projection_matrix(camera, aspect, depth_range(camera, bounds)) * view_matrix(camera) * glm::dvec4(point, 1.0);
  return glm::dvec3(clip) / clip.w;
}

TEST(Camera, FitShowsEveryPointAndTouchesTheMargin) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> coordinate(-1.0, 1.0);
    const double size = std::pow(10.0, 4 * coordinate(random));
    const glm::dvec3 offset = 3.0 * size * glm::dvec3(coordinate(random), coordinate(random), coordinate(random));
    std::vector<glm::dvec3> points;
    for (int i = 0; i < 50; ++i) {
      points.push_back(offset + size * glm::dvec3(coordinate(random), 0.3 * coordinate(random), coordinate(random)));
    }
    FitOptions options;
    options.aspect = 0.5 + seed / 10.0;
    const Camera camera = fit(points, options);
    ASSERT_TRUE(check_camera(camera));
    double widest = 0.0;
    for (const glm::dvec3& point : points) {
      const glm::dvec3 seen = project(camera, options.aspect, bounds_of(points), point);
      EXPECT_LE(std::abs(seen.z), 1.0);
      widest = std::max({widest, std::abs(seen.x), std::abs(seen.y)});
    }
    EXPECT_NEAR(widest, 1.0 - 2 * options.margin, 1e-9);
  }
}

TEST(Camera, FitOfABoxShowsItsCornersTheRightWayUp) {
  const Bounds box{{-1, -2, -3}, {4, 5, 6}};
  const Camera camera = fit(box);
  const auto seen = [&](glm::dvec3 point) { return project(camera, 4.0 / 3.0, box, point); };
  EXPECT_GT(seen({0, 5, 0}).y, seen({0, -2, 0}).y) << "y is up";
  EXPECT_GT(seen({4, 0, 0}).x, seen({-1, 0, 0}).x) << "x is to the right";
  EXPECT_LT(seen({0, 0, 6}).z, seen({0, 0, -3}).z) << "+z is near";
}

TEST(Camera, FitOfOnePointOrNoneIsStillACamera) {
  EXPECT_TRUE(check_camera(fit(Bounds{{1e6, 2, 3}, {1e6, 2, 3}})));
  EXPECT_TRUE(check_camera(fit(Bounds{})));
  EXPECT_TRUE(check_camera(fit(std::span<const glm::dvec3>())));
}

TEST(Camera, DepthRangeIsPositiveWhereverTheEyeStands) {
  const Bounds box{{-1, -1, -1}, {1, 1, 1}};
  for (const glm::dvec3 eye : {glm::dvec3(0, 0, 9), glm::dvec3(0, 0, 0.5), glm::dvec3(0, 0, -9), glm::dvec3(0, 0, 1)}) {
    const Camera camera{eye, eye - glm::dvec3(0, 0, 1)};
    const DepthRange range = depth_range(camera, box);
    EXPECT_GT(range.near_distance, 0.0);
    EXPECT_GT(range.far_distance, range.near_distance);
  }
}

TEST(Camera, ImpossibleOnesAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(check_camera(Camera{}));
  const std::vector<Camera> impossible = {{{nan, 0, 0}, {0, 0, 0}},
                                          {{1, 0, 0}, {0, infinity, 0}},
                                          {{1, 0, 0}, {0, 0, 0}, {0, nan, 0}},
                                          {{1, 2, 3}, {1, 2, 3}},
                                          {{0, 1, 0}, {0, 0, 0}},
                                          {{1, 0, 0}, {0, 0, 0}, {0, 0, 0}},
                                          {{1, 0, 0}, {0, 0, 0}, {0, 1, 0}, 0},
                                          {{1, 0, 0}, {0, 0, 0}, {0, 1, 0}, 180},
                                          {{1, 0, 0}, {0, 0, 0}, {0, 1, 0}, nan},
                                          {{1e308, 0, 0}, {-1e308, 0, 0}}};
  for (const Camera& camera : impossible) {
    const auto checked = check_camera(camera);
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().kind, ErrorKind::usage);
    EXPECT_EQ(checked.error().message.find("camera: "), 0U);
  }
}

}  // namespace
}  // namespace fanstream
