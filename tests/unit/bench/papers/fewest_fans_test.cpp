#include "tests/bench/papers/fewest_fans.h"

#include <gtest/gtest.h>

#include <bit>

#include "common/fans/fan_cover.h"
#include "tests/bench/papers/ellipsoid.h"
#include "tests/support/fan_test_meshes.h"

namespace fanstream::bench {
namespace {

TEST(LeastFans, AreNeverMoreThanACoverHas) {
  std::vector<TriangleMesh> meshes{test::make_tetrahedron(), test::make_octahedron(), test::make_torus(12, 9),
                                   make_octahedral_ellipsoid()};
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    meshes.push_back(test::punch_holes(test::make_random_sphere(40 * seed, seed), seed));
  }
  for (const TriangleMesh& mesh : meshes) {
    const auto fans = cover_with_fans(mesh.positions.size(), mesh.triangles);
    ASSERT_TRUE(fans);
    const std::size_t least = least_fans(mesh.positions.size(), mesh.triangles);
    EXPECT_GT(least, 0U);
    EXPECT_LE(least, fans->fans.size());
  }
  const TriangleMesh torus = test::make_torus(12, 9);
  EXPECT_EQ(least_fans(torus.positions.size(), torus.triangles), 36U) << "216 faces, six around each vertex";
  const TriangleMesh cones = test::make_double_cone(30);
  EXPECT_EQ(least_fans(cones.positions.size(), cones.triangles), 2U);
  EXPECT_EQ(least_fans(3, {}), 0U);
}

std::size_t fewest_of_all_choices(const TriangleMesh& mesh) {
  std::size_t fewest = mesh.positions.size();
  for (std::uint32_t centers = 0; centers < 1U << mesh.positions.size(); ++centers) {
    bool reach_all = true;
    for (const Triangle& t : mesh.triangles) {
      reach_all = reach_all && (centers & (1U << t[0] | 1U << t[1] | 1U << t[2])) != 0;
    }
    if (reach_all) fewest = std::min(fewest, static_cast<std::size_t>(std::popcount(centers)));
  }
  return fewest;
}

TEST(FewestCenters, AreThoseOfAllChoices) {
  std::vector<TriangleMesh> meshes{test::make_tetrahedron(), test::make_octahedron(), test::make_double_cone(9),
                                   test::make_torus(3, 4),
                                   test::join(test::make_tetrahedron(), test::make_octahedron(), {5, 0, 0})};
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    meshes.push_back(test::punch_holes(test::make_random_sphere(8 + seed % 6, seed), seed));
  }
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const auto fewest = fewest_centers(meshes[i].positions.size(), meshes[i].triangles);
    ASSERT_TRUE(fewest) << i;
    EXPECT_EQ(*fewest, fewest_of_all_choices(meshes[i])) << "mesh " << i;
  }
  EXPECT_EQ(fewest_centers(3, {}), 0U);
}

TEST(FewestCenters, AreNeverMoreThanACoverHasNorFewerThanValencesAllow) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const TriangleMesh mesh = test::make_random_sphere(20 * seed, seed);
    const auto fans = cover_with_fans(mesh.positions.size(), mesh.triangles);
    ASSERT_TRUE(fans);
    const auto fewest = fewest_centers(mesh.positions.size(), mesh.triangles);
    ASSERT_TRUE(fewest) << "seed " << seed;
    EXPECT_LE(*fewest, fans->fans.size()) << "seed " << seed;
    EXPECT_GE(*fewest, least_fans(mesh.positions.size(), mesh.triangles)) << "seed " << seed;
  }
}

TEST(FewestCenters, AreNotSoughtWhereTheMeshIsTooWide) {
  const TriangleMesh torus = test::make_torus(30, 30);
  EXPECT_FALSE(fewest_centers(torus.positions.size(), torus.triangles));
  const TriangleMesh narrow = test::make_torus(30, 6);
  EXPECT_TRUE(fewest_centers(narrow.positions.size(), narrow.triangles));
}

}  // namespace
}  // namespace fanstream::bench
