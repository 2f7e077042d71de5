#include "common/mesh/triangle_mesh.h"

#include <gtest/gtest.h>

namespace fanstream {
namespace {

TEST(TriangleMesh, ComponentsAreCountedBySharedVertices) {
  EXPECT_EQ(count_components(6, {{0, 1, 2}, {3, 4, 5}}), 2U);
  EXPECT_EQ(count_components(5, {{0, 1, 2}, {2, 3, 4}}), 1U);
  EXPECT_EQ(count_components(4, {{0, 1, 2}}), 2U);
}

TEST(TriangleMesh, BoundsEncloseEveryPosition) {
  const Bounds box = bounds_of({{1, 2, 3}, {-1, 5, 0}});
  EXPECT_EQ(box.low, glm::dvec3(-1, 2, 0));
  EXPECT_EQ(box.high, glm::dvec3(1, 5, 3));
}

}  // namespace
}  // namespace fanstream
