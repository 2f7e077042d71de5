#include "client/subdivide/subdivision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "tests/peers/opensubdiv_peer.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_meshes.h"
#include "tests/support/shared_data.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

double size_of(const PolygonMesh& mesh) {
  double size = 0;
  for (const glm::dvec4& point : mesh.points) {
    for (int i = 0; i < 4; ++i) size = std::max(size, std::abs(point[i]));
  }
  return size;
}

// Which corner of which of their faces is the first corner of a face of ours.
struct Match {
  FaceId face;
  std::size_t turn;
};

double distance(const PolygonMesh& a, FaceId f, const PolygonMesh& b, const Match& match) {
  const auto p = a.face(f);
  const auto q = b.face(match.face);
  if (p.size() != q.size()) return 1e300;
  double worst = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const glm::dvec4 d = a.points[p[i]] - b.points[q[(i + match.turn) % q.size()]];
    for (int axis = 0; axis < 4; ++axis) worst = std::max(worst, std::abs(d[axis]));
  }
  return worst;
}

// Both put a child into each corner of a face, in the order of the corners; which corner of the child comes first,
// there and here, is found by trying.
void expect_as_opensubdiv(const PolygonMesh& mesh, unsigned levels, BoundaryRule rule) {
  PolygonMesh ours = mesh;
  PolygonMesh theirs = mesh;
  std::vector<Match> matches;
  for (FaceId f = 0; f < mesh.face_count(); ++f) matches.push_back({f, 0});
  for (unsigned level = 1; level <= levels; ++level) {
    const Result<PolygonMesh> fine = subdivide(mesh, 2 * level, {rule});
    ASSERT_TRUE(fine) << fine.error().message;
    const PolygonMesh peer = refine_with_opensubdiv(mesh, level, rule);
    ASSERT_EQ(fine->face_count(), peer.face_count());
    ASSERT_EQ(fine->points.size(), peer.points.size());
    EXPECT_EQ(uniform_face_count(mesh, 2 * level), peer.face_count());
    EXPECT_TRUE(check_polygons(*fine));
    std::vector<Match> next(fine->face_count());
    double worst = 0;
    for (FaceId f = 0; f < ours.face_count(); ++f) {
      const std::size_t size = ours.face(f).size();
      for (std::size_t i = 0; i < size; ++i) {
        const FaceId child = ours.face_begins[f] + static_cast<FaceId>(i);
        const auto peer_child = static_cast<FaceId>(theirs.face_begins[matches[f].face] + (i + matches[f].turn) % size);
        double best = 1e300;
        for (std::size_t turn = 0; turn < 4; ++turn) {
          const double off = distance(*fine, child, peer, {peer_child, turn});
          if (off < best) next[child] = {peer_child, turn};
          best = std::min(best, off);
        }
        worst = std::max(worst, best);
      }
    }
    EXPECT_LT(worst, 1e-14 * size_of(mesh)) << "level " << level;
    ours = *fine;
    theirs = peer;
    matches = next;
  }
}

struct Shape {
  const char* label;
  PolygonMesh mesh;
};
void PrintTo(const Shape& shape, std::ostream* stream) { *stream << shape.label; }

std::vector<Shape> closed_shapes() {
  const PolygonMesh sphere = polygon_mesh(make_sphere(9, 13));
  const PolygonMesh torus = polygon_mesh(make_torus(11, 7));
  std::vector<Shape> shapes = {{"cube", make_cube()},
                               {"quad_torus", jittered(make_quad_torus(7, 5), 0.05, 1)},
                               {"tetrahedron", polygon_mesh(make_tetrahedron())},
                               {"triangle_sphere", sphere},
                               {"dual_sphere", dual_of(make_sphere(8, 11))},
                               {"mixed_weights", with_random_weights(with_dissolved_edges(torus, 0.4, 5), 6)}};
  static const char* const kLabels[] = {"mixed_0", "mixed_1", "mixed_2", "mixed_3", "mixed_4", "mixed_5"};
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const PolygonMesh& base = seed % 2 == 0 ? sphere : torus;
    shapes.push_back(
        {kLabels[seed], jittered(with_dissolved_edges(base, 0.2 + 0.15 * static_cast<double>(seed), seed), 0.1, seed)});
  }
  return shapes;
}

std::vector<Shape> open_shapes() {
  const PolygonMesh terrain = polygon_mesh(make_terrain(9, 7, 3));
  return {{"one_quad", make_quad_grid(1, 1)},
          {"grid", jittered(make_quad_grid(4, 3), 0.3, 2)},
          {"terrain", terrain},
          {"mixed_terrain", with_dissolved_edges(terrain, 0.5, 4)},
          {"mixed_terrain_weights", with_random_weights(with_dissolved_edges(terrain, 0.3, 9), 1)},
          {"cylinder", with_dissolved_edges(polygon_mesh(make_open_cylinder(9, 4)), 0.3, 8)}};
}

class ClosedShapes : public ::testing::TestWithParam<Shape> {};
class OpenShapes : public ::testing::TestWithParam<Shape> {};

TEST_P(ClosedShapes, TwoStepsAreOneStepOfOpenSubdiv) { expect_as_opensubdiv(GetParam().mesh, 3, BoundaryRule::smooth); }

TEST_P(ClosedShapes, HaveFacesOfMoreThanOneSize) {
  if (std::string(GetParam().label).find("mixed") == std::string::npos) GTEST_SKIP();
  std::map<std::size_t, int> sizes;
  for (FaceId f = 0; f < GetParam().mesh.face_count(); ++f) ++sizes[GetParam().mesh.face(f).size()];
  EXPECT_GE(sizes.size(), 3U);
}

TEST_P(OpenShapes, MatchBothBoundaryRulesOfOpenSubdiv) {
  expect_as_opensubdiv(GetParam().mesh, 3, BoundaryRule::smooth);
  expect_as_opensubdiv(GetParam().mesh, 3, BoundaryRule::corners);
}

INSTANTIATE_TEST_SUITE_P(Subdivision, ClosedShapes, ::testing::ValuesIn(closed_shapes()),
                         [](const auto& test) { return std::string(test.param.label); });
INSTANTIATE_TEST_SUITE_P(Subdivision, OpenShapes, ::testing::ValuesIn(open_shapes()),
                         [](const auto& test) { return std::string(test.param.label); });

class RealMeshes : public ::testing::TestWithParam<const char*> {};

TEST_P(RealMeshes, TwoStepsAreOneStepOfOpenSubdiv) {
  const std::filesystem::path path = shared_mesh(GetParam());
  if (path.empty()) GTEST_SKIP() << "the shared meshes are not here";
  const Result<ImportedMesh> imported = import_mesh(path);
  ASSERT_TRUE(imported) << imported.error().message;
  expect_as_opensubdiv(polygon_mesh(clean_mesh(imported->mesh).mesh), 1, BoundaryRule::corners);
}

INSTANTIATE_TEST_SUITE_P(Subdivision, RealMeshes,
                         ::testing::Values("cow_2904v.off", "fandisk_13k.obj", "boot_40k_genus12.ply",
                                           "mountain_terrain_51k_open.ply", "stanford_bunny_zipper.ply"),
                         [](const auto& test) { return "mesh_" + std::to_string(test.index); });

// The source: 4 faces of 4 corners around a point, the classic masks written out by hand.
TEST(Subdivision, AQuadOfAGridMovesByTheBicubicMasks) {
  const PolygonMesh grid = jittered(make_quad_grid(2, 2), 0.4, 11);
  const Result<PolygonMesh> fine = subdivide(grid, 2);
  ASSERT_TRUE(fine);
  glm::dvec4 edges(0);
  glm::dvec4 diagonals(0);
  for (const VertexId v : {1, 3, 5, 7}) edges += grid.points[v];
  for (const VertexId v : {0, 2, 6, 8}) diagonals += grid.points[v];
  const glm::dvec4 expected = (36.0 * grid.points[4] + 6.0 * edges + diagonals) / 64.0;
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(fine->points[4][i], expected[i], 1e-15);
}

TEST(Subdivision, AnOddStepGivesAQuadPerEdgeAndATrianglePerBoundaryEdge) {
  for (const unsigned depth : {1U, 3U, 5U}) {
    const PolygonMesh mesh = with_dissolved_edges(polygon_mesh(make_terrain(5, 4, 1)), 0.4, 3);
    const Result<PolygonMesh> odd = subdivide(mesh, depth);
    ASSERT_TRUE(odd);
    EXPECT_TRUE(check_polygons(*odd));
    const Result<PolygonMesh> before = subdivide(mesh, depth - 1);
    const Result<PolygonMesh> after = subdivide(mesh, depth + 1);
    ASSERT_TRUE(before && after);
    std::size_t triangles = 0;
    for (FaceId f = 0; f < odd->face_count(); ++f) {
      ASSERT_TRUE(odd->face(f).size() == 3 || odd->face(f).size() == 4);
      triangles += odd->face(f).size() == 3 ? 1 : 0;
    }
    const std::size_t boundary = 18U << (depth / 2);  // a grid of 5 x 4
    EXPECT_EQ(triangles, boundary);
    EXPECT_EQ(odd->face_count(), (before->corners.size() + boundary) / 2);
    EXPECT_EQ(odd->face_count(), uniform_face_count(mesh, depth));
    ASSERT_EQ(odd->points.size(), before->points.size() + before->face_count());
    // The even step moves nothing.
    EXPECT_TRUE(std::equal(odd->points.begin(), odd->points.end(), after->points.begin()));
  }
}

TEST(Subdivision, WeightsOfOneStayOneToTheLastBit) {
  const PolygonMesh mesh = with_dissolved_edges(polygon_mesh(make_sphere(9, 13)), 0.5, 7);
  const Result<PolygonMesh> fine = subdivide(mesh, 6);
  ASSERT_TRUE(fine);
  for (const glm::dvec4& point : fine->points) ASSERT_EQ(point.w, 1.0);
}

// A rational surface is refined as its control points in homogeneous coordinates are: a cylinder's quarter, whose
// weights make an exact circle of a B-spline, is not what the same places give without weights.
TEST(Subdivision, WeightsPullTheSurface) {
  PolygonMesh mesh = make_quad_grid(4, 4);
  mesh.points[12] = glm::dvec4(2, 2, 1, 1);
  const Result<PolygonMesh> plain = subdivide(mesh, 2);
  mesh.points[12] *= 4.0;
  const Result<PolygonMesh> pulled = subdivide(mesh, 2);
  ASSERT_TRUE(plain && pulled);
  EXPECT_GT(position(pulled->points[12]).z, position(plain->points[12]).z + 0.1);
}

TEST(Subdivision, IsIndifferentToTheOrderOfFacesAndFirstCorners) {
  const TriangleMesh base = make_torus(9, 6);
  const Result<PolygonMesh> one = subdivide(polygon_mesh(base), 4);
  const Result<PolygonMesh> other = subdivide(polygon_mesh(shuffled(base, 3)), 4);
  ASSERT_TRUE(one && other);
  const auto sorted = [](const PolygonMesh& mesh) {
    std::vector<std::array<long, 3>> rounded;
    for (const glm::dvec4& p : mesh.points) {
      rounded.push_back({std::lround(p.x * 1e9), std::lround(p.y * 1e9), std::lround(p.z * 1e9)});
    }
    std::sort(rounded.begin(), rounded.end());
    return rounded;
  };
  const auto a = sorted(*one);
  const auto b = sorted(*other);
  ASSERT_EQ(a.size(), b.size());
  std::size_t different = 0;
  for (std::size_t i = 0; i < a.size(); ++i) different += a[i] == b[i] ? 0 : 1;
  EXPECT_LT(different, a.size() / 50);  // a value at the edge between two roundings
}

TEST(Subdivision, DepthZeroIsTheMesh) {
  const PolygonMesh mesh = make_cube();
  const Result<PolygonMesh> same = subdivide(mesh, 0);
  ASSERT_TRUE(same);
  EXPECT_EQ(same->points, mesh.points);
  EXPECT_EQ(same->corners, mesh.corners);
}

TEST(Subdivision, UnusedVerticesStay) {
  PolygonMesh mesh = make_cube();
  mesh.points.emplace_back(7, 8, 9, 1);
  const Result<PolygonMesh> fine = subdivide(mesh, 4);
  ASSERT_TRUE(fine);
  EXPECT_EQ(fine->points[8], glm::dvec4(7, 8, 9, 1));
  EXPECT_EQ(fine->face_count(), 96U);
}

TEST(Subdivision, CollinearCornersAndFacesWithoutAreaAreDefined) {
  PolygonMesh mesh = make_cube();
  for (glm::dvec4& point : mesh.points) point.z = 0;  // all folded flat, four faces without area
  for (unsigned depth = 1; depth <= 5; ++depth) {
    const Result<PolygonMesh> fine = subdivide(mesh, depth);
    ASSERT_TRUE(fine);
    for (const glm::dvec4& p : fine->points) ASSERT_TRUE(std::isfinite(p.x) && p.z == 0.0 && p.w == 1.0);
  }
}

TEST(Subdivision, RefusesWhatWouldExceedTheLimitBeforeItIsMade) {
  const Result<PolygonMesh> vast = subdivide(make_cube(), 60);
  ASSERT_FALSE(vast);
  EXPECT_EQ(vast.error().kind, ErrorKind::limit);
  EXPECT_NE(vast.error().message.find("depth 23 is the greatest"), std::string::npos) << vast.error().message;
  ASSERT_FALSE(subdivide(make_cube(), 4'000'000'000U));
  SubdivisionOptions few;
  few.max_corners = 24 * 16;
  EXPECT_TRUE(subdivide(make_cube(), 4, few));
  EXPECT_FALSE(subdivide(make_cube(), 5, few));
}

struct BadMesh {
  const char* label;
  const char* message;
  PolygonMesh mesh;
};
void PrintTo(const BadMesh& bad, std::ostream* stream) { *stream << bad.label; }

std::vector<BadMesh> bad_meshes() {
  std::vector<BadMesh> bad;
  const auto add = [&](const char* label, const char* message, auto change) {
    bad.push_back({label, message, make_cube()});
    change(bad.back().mesh);
  };
  add("two_corners", "fewer than three corners", [](PolygonMesh& m) { m.add_face(std::array<VertexId, 2>{0, 1}); });
  add("out_of_range", "names vertex 8 of 8", [](PolygonMesh& m) { m.corners[5] = 8; });
  add("repeated", "twice", [](PolygonMesh& m) { m.corners[5] = m.corners[7]; });
  add("begins_beyond", "fewer than three corners", [](PolygonMesh& m) { m.face_begins[2] = 100; });
  add("begins_empty", "do not cover", [](PolygonMesh& m) { m.face_begins.clear(); });
  add("begins_short", "do not cover", [](PolygonMesh& m) { m.corners.push_back(3); });
  add("not_finite", "not finite", [](PolygonMesh& m) { m.points[3].y = NAN; });
  add("infinite", "not finite", [](PolygonMesh& m) { m.points[3].y = INFINITY; });
  add("no_weight", "weight", [](PolygonMesh& m) { m.points[3].w = 0; });
  add("negative_weight", "weight", [](PolygonMesh& m) { m.points[3].w = -1; });
  add("flipped", "wound differently", [](PolygonMesh& m) { std::swap(m.corners[1], m.corners[3]); });
  bad.push_back({"book", "more than two", polygon_mesh(make_book(3))});
  bad.push_back({"bowtie", "more than one fan", polygon_mesh(make_bowtie(3))});
  bad.push_back({"wide_bowtie", "more than one fan", polygon_mesh(make_bowtie(40))});
  return bad;
}

class BadMeshes : public ::testing::TestWithParam<BadMesh> {};

TEST_P(BadMeshes, AreRefusedWithTheirPlace) {
  const Result<PolygonMesh> result = subdivide(GetParam().mesh, 2);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::bad_input);
  EXPECT_NE(result.error().message.find(GetParam().message), std::string::npos) << result.error().message;
}

INSTANTIATE_TEST_SUITE_P(Subdivision, BadMeshes, ::testing::ValuesIn(bad_meshes()),
                         [](const auto& test) { return std::string(test.param.label); });

}  // namespace
}  // namespace fanstream
