#include "common/mesh/triangle_mesh.h"

#include <gtest/gtest.h>

namespace fanstream {
namespace {

TEST(TriangleMesh, AFaceHasHalfTheAreaOfItsParallelogram) {
  const TriangleMesh mesh{{{1, 1, 1}, {4, 1, 1}, {1, 5, 1}, {1, 1, 3}, {7, 1, 1}}, {}};
  EXPECT_DOUBLE_EQ(area_of(mesh, {0, 1, 2}), 6.0);
  EXPECT_DOUBLE_EQ(area_of(mesh, {2, 1, 0}), 6.0) << "whichever way it faces";
  EXPECT_DOUBLE_EQ(area_of(mesh, {0, 2, 3}), 4.0);
  EXPECT_EQ(area_of(mesh, {0, 1, 4}), 0.0) << "on a line";
  EXPECT_EQ(area_of(mesh, {3, 3, 3}), 0.0);
}

}  // namespace
}  // namespace fanstream
