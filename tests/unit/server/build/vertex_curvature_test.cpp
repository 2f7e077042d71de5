#include "server/build/vertex_curvature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

std::vector<double> curvature_of(const TriangleMesh& mesh, Curvature which) {
  return vertex_curvature(mesh, RingMesh::from_triangles(mesh.positions.size(), mesh.triangles), which);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

TEST(VertexCurvature, OnASphereItIsThatOfTheRadius) {
  for (const double radius : {0.5, 1.0, 4.0}) {
    const TriangleMesh mesh = testing::make_sphere(60, 90, radius);
    EXPECT_NEAR(median(curvature_of(mesh, Curvature::mean)), -2.0 / radius, 0.04 / radius);
    EXPECT_NEAR(median(curvature_of(mesh, Curvature::gaussian)), 1.0 / (radius * radius), 0.02 / (radius * radius));
    EXPECT_NEAR(median(curvature_of(mesh, Curvature::principal)), 4.0 / radius, 0.08 / radius);
  }
}

TEST(VertexCurvature, TheInsideOfASphereHasTheOtherSign) {
  TriangleMesh mesh = testing::make_sphere(40, 40);
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  EXPECT_NEAR(median(curvature_of(mesh, Curvature::mean)), 2.0, 0.05);
  EXPECT_NEAR(median(curvature_of(mesh, Curvature::gaussian)), 1.0, 0.02);
}

TEST(VertexCurvature, GaussianCurvatureAddsUpToTheEulerCharacteristic) {
  const auto total = [](const TriangleMesh& mesh) {
    const std::vector<double> k = curvature_of(mesh, Curvature::gaussian);
    double sum = 0.0;
    for (const Triangle& t : mesh.triangles) {
      const glm::dvec3 a = mesh.positions[t[1]] - mesh.positions[t[0]];
      const glm::dvec3 b = mesh.positions[t[2]] - mesh.positions[t[0]];
      const double area = 0.5 * std::sqrt(std::pow(a.y * b.z - a.z * b.y, 2) + std::pow(a.z * b.x - a.x * b.z, 2) +
                                          std::pow(a.x * b.y - a.y * b.x, 2));
      for (const VertexId v : t) sum += k[v] * area / 3.0;
    }
    return sum / (2.0 * std::numbers::pi);
  };
  EXPECT_NEAR(total(testing::make_sphere(9, 14)), 2.0, 1e-9);
  EXPECT_NEAR(total(testing::make_torus(12, 9)), 0.0, 1e-9);
  EXPECT_NEAR(total(testing::make_terrain(9, 7, 3)), 1.0, 1e-9);  // a disc: pi at the boundary
  EXPECT_NEAR(total(testing::make_open_cylinder(12, 4)), 0.0, 1e-9);
}

TEST(VertexCurvature, AFlatSheetHasNoneButAtItsCorners) {
  const TriangleMesh mesh = testing::make_grid(6, 5);
  for (const double h : curvature_of(mesh, Curvature::mean)) EXPECT_NEAR(h, 0.0, 1e-12);
  const std::vector<double> k = curvature_of(mesh, Curvature::gaussian);
  EXPECT_EQ(std::count_if(k.begin(), k.end(), [](double x) { return std::fabs(x) > 1e-9; }), 4);
}

TEST(VertexCurvature, ACylinderBendsOneWay) {
  const double radius = 2.0;
  const TriangleMesh mesh = testing::make_open_cylinder(80, 20, radius, 4.0);
  EXPECT_NEAR(median(curvature_of(mesh, Curvature::mean)), -1.0 / radius, 0.01);
  EXPECT_NEAR(median(curvature_of(mesh, Curvature::gaussian)), 0.0, 1e-9);
  EXPECT_NEAR(median(curvature_of(mesh, Curvature::principal)), 2.0 / radius, 0.02);
}

TEST(VertexCurvature, SharpEdgesHaveTheirAngle) {
  const TriangleMesh mesh = testing::make_tetrahedron();
  const double edge = std::sqrt(std::pow(mesh.positions[0].x - mesh.positions[1].x, 2) +
                                std::pow(mesh.positions[0].y - mesh.positions[1].y, 2) +
                                std::pow(mesh.positions[0].z - mesh.positions[1].z, 2));
  const double area = 3.0 * std::sqrt(3.0) / 4.0 * edge * edge;
  const double angle = std::numbers::pi - std::acos(1.0 / 3.0);
  for (const double h : curvature_of(mesh, Curvature::mean)) {
    EXPECT_NEAR(h, -0.5 * 3.0 * edge * angle / (area / 3.0), 1e-9);
  }
  for (const double k : curvature_of(mesh, Curvature::gaussian)) {
    EXPECT_NEAR(k, std::numbers::pi / (area / 3.0), 1e-9);
  }
}

TEST(VertexCurvature, FacesWithoutAreaGiveFiniteNumbers) {
  TriangleMesh mesh = testing::make_sphere(8, 10);
  for (std::size_t v = 0; v < 20; ++v) mesh.positions[v] = mesh.positions[0];                    // coincident
  for (std::size_t v = 30; v < 50; ++v) mesh.positions[v] = {static_cast<double>(v), 0.0, 0.0};  // on a line
  for (const Curvature which : {Curvature::mean, Curvature::gaussian, Curvature::principal}) {
    for (const double c : curvature_of(mesh, which)) EXPECT_TRUE(std::isfinite(c));
  }
}

}  // namespace
}  // namespace fanstream
