#include "client/subdivide/view_subdivision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>

#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_meshes.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

View view_from(const glm::dvec3& eye, double fov_deg = 40.0) {
  View view;
  view.camera = {eye, {0, 0, 0}, {0.1, 1, 0.2}, fov_deg};
  return view;
}

// By the planes of the faces' own corners, as the header says, written independently of it.
std::pair<bool, bool> facing(const PolygonMesh& mesh, FaceId f, const glm::dvec3& eye) {
  std::pair<bool, bool> result{false, false};
  const auto face = mesh.face(f);
  glm::dvec3 mean(0);
  for (std::size_t i = 0; i < face.size(); ++i) {
    mean += glm::cross(position(mesh.points[face[i]]), position(mesh.points[face[(i + 1) % face.size()]]));
  }
  for (std::size_t i = 0; i < face.size(); ++i) {
    const glm::dvec3 a = position(mesh.points[face[i]]);
    const glm::dvec3 b = position(mesh.points[face[(i + 1) % face.size()]]);
    const glm::dvec3 c = position(mesh.points[face[(i + 2) % face.size()]]);
    glm::dvec3 normal = glm::cross(b - a, c - b);
    if (face.size() > 3 && glm::dot(normal, mean) < 0) normal = -normal;
    const double side = glm::dot(normal, eye - b);
    result.first |= side > 0;
    result.second |= side < 0;
  }
  return result;
}

std::vector<std::uint8_t> silhouette_faces(const PolygonMesh& mesh, const glm::dvec3& eye) {
  std::map<std::pair<VertexId, VertexId>, FaceId> face_of;
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) face_of[{face[i], face[(i + 1) % face.size()]}] = f;
  }
  std::vector<std::uint8_t> on(mesh.points.size(), 0);
  for (const auto& [edge, f] : face_of) {
    const auto other = face_of.find({edge.second, edge.first});
    if (other == face_of.end()) continue;
    if (!facing(mesh, f, eye).first || !facing(mesh, other->second, eye).second) continue;
    on[edge.first] = on[edge.second] = 1;
  }
  std::vector<std::uint8_t> faces(mesh.face_count(), 0);
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    for (const VertexId v : mesh.face(f)) faces[f] |= on[v];
  }
  return faces;
}

ViewSubdivisionOptions by_depth_alone() {
  ViewSubdivisionOptions options;
  options.size_px = 0;
  return options;
}

struct Case {
  const char* label;
  PolygonMesh mesh;
};
std::vector<Case> cases() {
  return {{"sphere", polygon_mesh(make_sphere(20, 30))},
          {"dual_sphere", dual_of(make_sphere(20, 30))},
          {"mixed_torus", with_dissolved_edges(polygon_mesh(make_torus(60, 40)), 0.1, 1)},
          {"quad_torus", make_quad_torus(48, 32)}};
}

TEST(ViewSubdivision, IsWatertightFromAllSides) {
  for (const Case& test : cases()) {
    for (const glm::dvec3 eye : {glm::dvec3(0, 0, 4), glm::dvec3(3, 1, -2), glm::dvec3(0.2, 1.4, 0.1)}) {
      const auto result = subdivide_for_view(test.mesh, view_from(eye), by_depth_alone());
      ASSERT_TRUE(result) << result.error().message;
      ASSERT_TRUE(check_polygons(result->refined.mesh)) << test.label;
      std::map<std::pair<VertexId, VertexId>, int> balance;
      for (FaceId f = 0; f < result->refined.mesh.face_count(); ++f) {
        const auto face = result->refined.mesh.face(f);
        for (std::size_t i = 0; i < face.size(); ++i) {
          const VertexId a = face[i];
          const VertexId b = face[(i + 1) % face.size()];
          balance[std::minmax(a, b)] += a < b ? 1 : -1;
        }
      }
      for (const auto& [edge, sum] : balance) ASSERT_EQ(sum, 0) << test.label;
    }
  }
}

TEST(ViewSubdivision, FrontFacesReachTheirDepthAndTheBackStaysCoarse) {
  const glm::dvec3 eye(0.3, 0.5, 5);
  for (const Case& test : cases()) {
    const auto result = subdivide_for_view(test.mesh, view_from(eye), by_depth_alone());
    ASSERT_TRUE(result);
    std::vector<std::uint8_t> least(test.mesh.face_count(), 255);
    for (FaceId f = 0; f < result->refined.mesh.face_count(); ++f) {
      std::uint8_t& depth = least[result->refined.face_origins[f]];
      depth = std::min(depth, result->refined.face_depths[f]);
    }
    std::size_t front = 0;
    std::size_t untouched = 0;
    std::vector<std::uint8_t> turned_away(test.mesh.points.size(), 0);
    for (FaceId f = 0; f < test.mesh.face_count(); ++f) {
      if (!facing(test.mesh, f, eye).second) continue;
      for (const VertexId v : test.mesh.face(f)) turned_away[v] = 1;
    }
    for (FaceId f = 0; f < test.mesh.face_count(); ++f) {
      untouched += least[f] == 0 ? 1 : 0;
      const auto face = test.mesh.face(f);
      if (std::any_of(face.begin(), face.end(), [&](VertexId v) { return turned_away[v] != 0; })) continue;
      ++front;
      EXPECT_GE(least[f], 4) << test.label << " face " << f;
    }
    EXPECT_GT(front, test.mesh.face_count() / 5) << test.label;
    EXPECT_GT(untouched, test.mesh.face_count() / 8) << test.label;
    EXPECT_LE(untouched + front, test.mesh.face_count());
    EXPECT_GE(result->front_faces, front) << test.label;
  }
}

TEST(ViewSubdivision, TheSilhouetteOfTheResultIsAtItsDepth) {
  for (const Case& test : cases()) {
    for (const unsigned rings : {0U, 1U}) {
      for (const glm::dvec3 eye : {glm::dvec3(0.3, 0.5, 5), glm::dvec3(-3, 2, 2)}) {
        ViewSubdivisionOptions options = by_depth_alone();
        options.silhouette_rings = rings;
        const auto result = subdivide_for_view(test.mesh, view_from(eye), options);
        ASSERT_TRUE(result);
        const std::vector<std::uint8_t> silhouette = silhouette_faces(result->refined.mesh, eye);
        std::size_t all = 0;
        std::size_t shallow = 0;
        std::size_t very_shallow = 0;
        for (FaceId f = 0; f < silhouette.size(); ++f) {
          if (silhouette[f] == 0) continue;
          ++all;
          shallow += result->refined.face_depths[f] < 8 ? 1 : 0;
          very_shallow += result->refined.face_depths[f] < 6 ? 1 : 0;
        }
        EXPECT_GT(all, 300U) << test.label;
        EXPECT_LE(shallow, rings == 0 ? all / 8 : all / 200) << test.label << " eye " << eye.x;
        EXPECT_LE(very_shallow, all / 100) << test.label << " eye " << eye.x;
      }
    }
  }
}

TEST(ViewSubdivision, CostsLessThanRefiningAllToTheDepthOfTheSilhouette) {
  const PolygonMesh mesh = polygon_mesh(make_sphere(9, 14));
  const auto result = subdivide_for_view(mesh, view_from({0, 0, 5}), by_depth_alone());
  ASSERT_TRUE(result);
  EXPECT_LT(result->refined.mesh.face_count() * 6, uniform_face_count(mesh, 8));
}

// A flat face with a reflex corner, as files have them, faces one way only.
TEST(ViewSubdivision, AConcaveFaceIsNotSeenFromBothSides) {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0, 1}, {2, 0, 0, 1}, {2, 2, 0, 1}, {1, 0.5, 0, 1}, {0, 2, 0, 1}};
  mesh.add_face(std::array<VertexId, 5>{0, 1, 2, 3, 4});
  EXPECT_EQ(subdivide_for_view(mesh, view_from({0, 0, 9}), by_depth_alone())->front_faces, 1U);
  EXPECT_EQ(subdivide_for_view(mesh, view_from({0, 0, -9}), by_depth_alone())->front_faces, 0U);
}

// A quad folded along its diagonal so that one half faces the eye and the other one away.
TEST(ViewSubdivision, AFaceMayFaceBothWays) {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0, 1}, {1, 0, 0, 1}, {0.5, 0.5, -2, 1}, {0, 1, 0, 1}};
  mesh.add_face(std::array<VertexId, 4>{0, 1, 2, 3});
  const auto [front, back] = facing(mesh, 0, {0.4, 0.4, 30});
  ASSERT_TRUE(front);
  View view = view_from({0.45, 3, -4});
  ASSERT_TRUE(facing(mesh, 0, view.camera.eye).first && facing(mesh, 0, view.camera.eye).second);
  const auto result = subdivide_for_view(mesh, view, by_depth_alone());
  ASSERT_TRUE(result);
  EXPECT_EQ(result->front_faces, 1U);
  EXPECT_EQ(result->silhouette_faces, 1U);
}

TEST(ViewSubdivision, WhatIsOutsideTheViewVolumeStays) {
  const PolygonMesh mesh = make_quad_grid(40, 40);
  View view;
  view.camera = {{5, 5, 4}, {5, 5, 0}, {0, 1, 0}, 40.0};
  const auto result = subdivide_for_view(mesh, view, by_depth_alone());
  ASSERT_TRUE(result);
  for (FaceId f = 0; f < result->refined.mesh.face_count(); ++f) {
    glm::dvec3 middle(0);
    for (const VertexId v : result->refined.mesh.face(f)) middle += position(result->refined.mesh.points[v]);
    middle /= static_cast<double>(result->refined.mesh.face(f).size());
    const double away = std::max(std::abs(middle.x - 5), std::abs(middle.y - 5));
    if (away > 5) {
      ASSERT_EQ(result->refined.face_depths[f], 0) << middle.x << " " << middle.y;
    }
    if (away < 1.4) {
      ASSERT_EQ(result->refined.face_depths[f], 4) << middle.x << " " << middle.y;
    }
  }
  view.camera.target = {5, 5, 8};  // looks away
  const auto nothing = subdivide_for_view(mesh, view, by_depth_alone());
  ASSERT_TRUE(nothing);
  EXPECT_EQ(nothing->refined.mesh.face_count(), mesh.face_count());
}

TEST(ViewSubdivision, FacesStopOnceTheyAreSmallOnTheScreen) {
  const PolygonMesh mesh = make_quad_torus(14, 8);
  ViewSubdivisionOptions options;
  options.front_depth = 12;
  options.silhouette_depth = 12;
  std::size_t before = 0;
  for (const double size_px : {400.0, 60.0, 20.0, 8.0}) {
    options.size_px = size_px;
    const View view = view_from({0, 1, 4});
    const auto result = subdivide_for_view(mesh, view, options);
    ASSERT_TRUE(result);
    EXPECT_GT(result->refined.mesh.face_count(), before);
    before = result->refined.mesh.face_count();
  }
  options.size_px = 1e6;
  EXPECT_EQ(subdivide_for_view(mesh, view_from({0, 1, 4}), options)->refined.mesh.face_count(), mesh.face_count());
  // Nearer is larger.
  options.size_px = 20;
  const std::size_t far = subdivide_for_view(mesh, view_from({0, 0, 8}), options)->refined.mesh.face_count();
  const std::size_t near = subdivide_for_view(mesh, view_from({0, 0, 4}), options)->refined.mesh.face_count();
  EXPECT_GT(near, far);
}

TEST(ViewSubdivision, FlatPartsStopByTheTolerance) {
  PolygonMesh mesh = make_quad_grid(16, 16);
  for (glm::dvec4& p : mesh.points) p.z = p.x > 12 ? (p.x - 12) * (p.x - 12) * 0.3 : 0.0;  // flat, then bent
  View view;
  view.camera = {{8, 8, 30}, {8, 8, 0}, {0, 1, 0}, 45.0};
  ViewSubdivisionOptions options = by_depth_alone();
  options.silhouette_depth = 0;
  options.tolerance_px = 0.2;
  const auto result = subdivide_for_view(mesh, view, options);
  ASSERT_TRUE(result);
  std::size_t flat_refined = 0;
  std::size_t bent_refined = 0;
  for (FaceId f = 0; f < result->refined.mesh.face_count(); ++f) {
    const FaceId origin = result->refined.face_origins[f];
    if (result->refined.face_depths[f] < 2) continue;
    (origin % 16 < 9 && origin % 16 > 1 ? flat_refined : bent_refined) += 1;
  }
  EXPECT_EQ(flat_refined, 0U);
  EXPECT_GT(bent_refined, 100U);
}

TEST(ViewSubdivision, OnlyEligibleFacesAreRefined) {
  const PolygonMesh mesh = polygon_mesh(make_sphere(9, 14));
  std::vector<std::uint8_t> eligible(mesh.face_count(), 0);
  for (FaceId f = 0; f < mesh.face_count(); f += 1) {
    eligible[f] = position(mesh.points[mesh.face(f)[0]]).x > 0 ? 1 : 0;
  }
  const auto result = subdivide_for_view(mesh, view_from({0, 0, 5}), by_depth_alone(), eligible);
  ASSERT_TRUE(result);
  ASSERT_TRUE(check_polygons(result->refined.mesh));
  std::vector<int> pieces(mesh.face_count(), 0);
  for (FaceId f = 0; f < result->refined.mesh.face_count(); ++f) {
    if (result->refined.face_depths[f] > 0) {
      EXPECT_EQ(eligible[result->refined.face_origins[f]], 1);
    }
    ++pieces[result->refined.face_origins[f]];
  }
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    if (eligible[f] == 0) {
      EXPECT_EQ(pieces[f], 1);
    }
  }
  EXPECT_GT(result->refined.mesh.face_count(), 2 * mesh.face_count());
}

TEST(ViewSubdivision, EqualInputsGiveEqualMeshes) {
  const PolygonMesh mesh = make_quad_torus(14, 8);
  const auto one = subdivide_for_view(mesh, view_from({1, 2, 3}));
  const auto other = subdivide_for_view(mesh, view_from({1, 2, 3}));
  ASSERT_TRUE(one && other);
  EXPECT_EQ(one->refined.mesh.points, other->refined.mesh.points);
  EXPECT_EQ(one->refined.mesh.corners, other->refined.mesh.corners);
}

TEST(ViewSubdivision, SaysWhatIsWrong) {
  const PolygonMesh mesh = make_cube();
  ViewSubdivisionOptions options;
  options.front_depth = 25;
  EXPECT_EQ(subdivide_for_view(mesh, view_from({0, 0, 5}), options).error().kind, ErrorKind::usage);
  options = {};
  options.size_px = -1;
  EXPECT_EQ(subdivide_for_view(mesh, view_from({0, 0, 5}), options).error().kind, ErrorKind::usage);
  EXPECT_EQ(subdivide_for_view(mesh, view_from({0, 0, 0})).error().kind, ErrorKind::usage);
  const std::vector<std::uint8_t> mask(5, 1);
  EXPECT_EQ(subdivide_for_view(mesh, view_from({0, 0, 5}), {}, mask).error().kind, ErrorKind::usage);
  options = {};
  options.subdivision.max_corners = 100;
  EXPECT_EQ(subdivide_for_view(mesh, view_from({0, 0, 5}), options).error().kind, ErrorKind::limit);
  options = {};
  options.stop = [](unsigned depth) { return depth == 3; };
  EXPECT_EQ(subdivide_for_view(mesh, view_from({0, 0, 5}), options).error().kind, ErrorKind::interrupted);
}

}  // namespace
}  // namespace fanstream
