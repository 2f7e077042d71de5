#include "client/smooth/smooth_silhouette.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>

#include "common/mesh/manifold_check.h"
#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_sources.h"
#include "tests/support/progressive_checks.h"

namespace fanstream {
namespace {

using testing::OpenAsset;
using testing::SeededRandom;

View view_of(const std::vector<glm::dvec3>& positions, const glm::dvec3& from = {0.5, 0.4, 1.0}) {
  FitOptions fit_options;
  fit_options.from = from;
  View view;
  view.camera = fit(positions, fit_options);
  view.width_px = 800;
  view.height_px = 600;
  view.near_distance = depth_range(view.camera, bounds_of(positions)).near_distance;
  return view;
}

// A mesh as it is, all of it finest.
LiveFaces faces_of(const TriangleMesh& mesh, const std::vector<std::uint32_t>& source_faces = {}) {
  LiveFaces live;
  live.positions = mesh.positions;
  live.triangles = mesh.triangles;
  std::vector<std::uint8_t> inner = inner_edges(mesh.triangles, source_faces);
  live.faces = join_triangles(mesh.triangles, inner);
  live.finest.assign(live.faces.face_count(), 1);
  return live;
}

SmoothedMesh smoothed(const LiveFaces& live, const SmoothOptions& options = {}) {
  const Result<SmoothedMesh> done = smooth_for_view(live, view_of(live.positions), options);
  EXPECT_TRUE(done) << done.error().message;
  return done ? *done : SmoothedMesh{};
}

// A box of quads with n x n of them on each side.
struct Quads {
  TriangleMesh mesh;
  std::vector<std::uint32_t> faces;
};
Quads box(unsigned n) {
  std::map<std::array<unsigned, 3>, VertexId> at;
  Quads quads;
  const auto vertex = [&](const std::array<unsigned, 3>& p) {
    const auto [found, fresh] = at.insert({p, static_cast<VertexId>(quads.mesh.positions.size())});
    if (fresh) quads.mesh.positions.emplace_back(p[0], p[1], p[2]);
    return found->second;
  };
  for (unsigned axis = 0; axis < 3; ++axis) {
    for (const unsigned side : {0U, n}) {
      for (unsigned i = 0; i < n; ++i) {
        for (unsigned j = 0; j < n; ++j) {
          std::array<VertexId, 4> corners{};
          for (unsigned k = 0; k < 4; ++k) {
            std::array<unsigned, 3> p{};
            p[axis] = side;
            p[(axis + 1) % 3] = i + (k == 1 || k == 2 ? 1 : 0);
            p[(axis + 2) % 3] = j + (k >= 2 ? 1 : 0);
            corners[k] = vertex(p);
          }
          if (side == 0) std::swap(corners[1], corners[3]);
          const auto face = static_cast<std::uint32_t>(quads.mesh.triangles.size());
          quads.mesh.triangles.push_back({corners[0], corners[1], corners[2]});
          quads.mesh.triangles.push_back({corners[0], corners[2], corners[3]});
          quads.faces.insert(quads.faces.end(), 2, face);
        }
      }
    }
  }
  return quads;
}

// The outline of a torus in a view from its axis is a circle; how far the smoothed one's corners turn at most.
TEST(SmoothSilhouette, ACoarseTorusGetsARoundOutline) {
  const TriangleMesh torus = testing::make_torus(12, 8);
  const LiveFaces live = faces_of(torus, testing::paired_source_faces(torus));
  ASSERT_EQ(live.faces.face_count(), 96U);
  SmoothOptions options;
  options.tolerance_px = 0.0;
  const Result<SmoothedMesh> done = smooth_for_view(live, view_of(torus.positions, {0, 0, 1}), options);
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->report.eligible_faces, 96U);
  EXPECT_EQ(done->report.depth, 8U);
  EXPECT_GT(done->report.faces_after, 960U);
  // The outermost vertices by angle: they keep their distance from the axis, where the torus' own have 12 corners.
  std::array<double, 120> farthest{};
  for (const glm::dvec3& p : done->mesh.positions) {
    const double angle = std::atan2(p.y, p.x) / std::acos(-1.0) * 180.0 + 180.0;
    double& most = farthest[static_cast<std::size_t>(angle / 3.0) % farthest.size()];
    most = std::max(most, std::hypot(p.x, p.y));
  }
  std::sort(farthest.begin(), farthest.end());
  ASSERT_GT(farthest.front(), 1.0) << "a vertex in each three degrees of the outline";
  EXPECT_LT(farthest.back() / farthest.front(), 1.01) << "1.035 before";
  EXPECT_GT(farthest.front(), 1.35 * 0.9);
  EXPECT_LT(farthest.back(), 1.35);
}

TEST(SmoothSilhouette, TheResultIsClosedWhereTheMeshIs) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const LiveFaces live = faces_of(mesh, testing::random_source_faces(mesh, 3, 5));
    SmoothOptions options;
    options.crease_angle_deg = 180;
    options.size_px = 6.0;
    const SmoothedMesh done = smoothed(live, options);
    std::string why;
    EXPECT_TRUE(is_oriented_manifold(done.mesh, &why)) << why;
    EXPECT_EQ(testing::topology_of(done.mesh), testing::topology_of(mesh));
    EXPECT_EQ(done.report.triangles_after, done.mesh.triangles.size());
  }
}

TEST(SmoothSilhouette, ABoxStaysABoxUnlessAllCreasesAreToBeSmoothed) {
  const Quads one = box(1);
  const SmoothedMesh same = smoothed(faces_of(one.mesh, one.faces));
  EXPECT_EQ(same.mesh.positions, one.mesh.positions);
  EXPECT_EQ(same.mesh.triangles, one.mesh.triangles);
  EXPECT_EQ(same.report.eligible_faces, 0U);
  EXPECT_EQ(same.report.depth, 0U);
  EXPECT_EQ(same.report.faces_after, same.report.faces_before);

  const Quads five = box(5);
  const LiveFaces live = faces_of(five.mesh, five.faces);
  SmoothOptions options;
  EXPECT_EQ(smoothed(live, options).report.eligible_faces, 6U * 9U) << "all but those at the edges";
  options.crease_angle_deg = 180;
  const SmoothedMesh round = smoothed(live, options);
  EXPECT_EQ(round.report.eligible_faces, 150U);
  const Bounds bounds = bounds_of(round.mesh.positions);
  EXPECT_LT(bounds.high.x, 5.0 + 1e-9);
  const glm::dvec3 corner(5.0);  // seen
  const auto at = std::find(five.mesh.positions.begin(), five.mesh.positions.end(), corner);
  ASSERT_NE(at, five.mesh.positions.end());
  EXPECT_NE(round.mesh.positions[static_cast<std::size_t>(at - five.mesh.positions.begin())], corner);
}

TEST(SmoothSilhouette, ABoundaryIsSmoothedButForItsCorners) {
  const TriangleMesh grid = testing::make_grid(6, 4);
  const LiveFaces live = faces_of(grid, testing::paired_source_faces(grid));
  const std::vector<std::uint8_t> eligible = eligible_faces(live, 75.0);
  EXPECT_EQ(std::count(eligible.begin(), eligible.end(), 0), 4);
  const std::vector<std::uint8_t> all = eligible_faces(live, 180.0);
  EXPECT_EQ(std::count(all.begin(), all.end(), 0), 0);
}

TEST(SmoothSilhouette, VerticesThatShareAPlaceStayTogether) {
  TriangleMesh two = testing::make_terrain(6, 6, 1);
  const std::size_t count = two.triangles.size();
  TriangleMesh other = two;
  testing::append(two, other,
                  {6.0, 0.0, 0.0});  // the right edge of one lies on no vertex of the other, as heights differ
  LiveFaces live = faces_of(two);
  const auto open = eligible_faces(live, 180.0);
  EXPECT_EQ(static_cast<std::size_t>(std::count(open.begin(), open.end(), 1)), 2 * count);
  live.positions[49] = live.positions[6];
  const auto eligible = eligible_faces(live, 180.0);
  std::size_t fixed = 0;
  for (std::uint32_t f = 0; f < eligible.size(); ++f) {
    const auto face = live.faces.face(f);
    const bool touches = std::any_of(face.begin(), face.end(), [](VertexId v) { return v == 49 || v == 6; });
    EXPECT_EQ(eligible[f], touches ? 0 : 1);
    fixed += touches ? 1 : 0;
  }
  EXPECT_GT(fixed, 0U);
}

TEST(SmoothSilhouette, DepthsAreLoweredUntilTheResultFits) {
  const TriangleMesh torus = testing::make_torus(20, 14);
  const LiveFaces live = faces_of(torus, testing::paired_source_faces(torus));
  std::uint64_t before = ~std::uint64_t{0}, whole = 0;
  for (const std::uint64_t most : {1'000'000U, 8'000U, 3'000U, 1'200U, 600U, 100U}) {
    SCOPED_TRACE(most);
    SmoothOptions options;
    options.max_triangles = most;
    const SmoothedMesh done = smoothed(live, options);
    if (before == ~std::uint64_t{0}) whole = done.mesh.triangles.size();
    EXPECT_EQ(done.report.limitation.empty(), most >= whole) << done.report.limitation;
    EXPECT_LE(done.mesh.triangles.size(), std::max<std::uint64_t>(most, torus.triangles.size()));
    EXPECT_LE(done.mesh.triangles.size(), before);
    EXPECT_GE(done.mesh.triangles.size(), torus.triangles.size());
    before = done.mesh.triangles.size();
  }
}

TEST(SmoothSilhouette, CanBeStopped) {
  const TriangleMesh torus = testing::make_torus(20, 14);
  SmoothOptions options;
  options.stop = [] { return true; };
  const auto done = smooth_for_view(faces_of(torus), view_of(torus.positions), options);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::interrupted);
}

class Received {
 public:
  explicit Received(const TriangleMesh& mesh, std::vector<std::uint32_t> source_faces)
      : source_faces_(std::move(source_faces)) {
    BuildOptions options = testing::small_cells();
    options.source_faces = source_faces_;
    asset = testing::build_and_open(mesh, options);
    live = std::make_unique<ProgressiveMesh>(asset.head, MeshMemory::live_part);
    live->set_index(asset.index);
    for (const auto& [cell, segment] : asset.segments()) {
      EXPECT_TRUE(live->add_segment(cell, segment, asset.segment(cell, segment)));
    }
  }
  void take_polygons() {
    const std::span<const std::byte> bytes =
        std::span(asset.bytes).subspan(asset.index->polygon_offset, asset.index->polygons.size_bytes);
    EXPECT_TRUE(live->add_segment(asset.index->polygon_cell(), 0, bytes));
  }
  void refine_all() {
    live->set_all_targets(ProgressiveMesh::kEverySegment);
    (void)live->move_to({});
  }

  OpenAsset asset;
  std::unique_ptr<ProgressiveMesh> live;

 private:
  std::vector<std::uint32_t> source_faces_;
};

TEST(SilhouetteSmoother, WaitsForThePolygons) {
  const TriangleMesh torus = testing::make_torus(30, 20);
  Received received(torus, testing::paired_source_faces(torus));
  received.refine_all();
  SilhouetteSmoother smoother({});
  const View view = view_of(torus.positions);
  const Result<SmoothedMesh> before = smoother.smooth(*received.live, view);
  ASSERT_TRUE(before) << before.error().message;
  EXPECT_EQ(before->report.finest_faces, 0U);
  EXPECT_NE(before->report.limitation.find("have not been received"), std::string::npos);
  EXPECT_EQ(before->mesh.positions, received.live->triangle_mesh().positions);
  EXPECT_EQ(before->mesh.triangles, received.live->triangle_mesh().triangles);
  received.take_polygons();
  const Result<SmoothedMesh> after = smoother.smooth(*received.live, view);
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_EQ(after->report.finest_faces, 600U);
  EXPECT_EQ(after->report.faces_before, 600U);
  EXPECT_TRUE(after->report.limitation.empty()) << after->report.limitation;
  EXPECT_GT(after->report.faces_after, 1200U);
}

TEST(SilhouetteSmoother, AModelOfTrianglesNeedsNone) {
  const TriangleMesh sphere = testing::make_sphere(18, 24);
  Received received(sphere, {});
  received.refine_all();
  const Result<SmoothedMesh> done = SilhouetteSmoother({}).smooth(*received.live, view_of(sphere.positions));
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->report.finest_faces, sphere.triangles.size());
  EXPECT_GT(done->report.faces_after, 2 * sphere.triangles.size());
}

TEST(SilhouetteSmoother, ADamagedSectionIsToldAndNothingIsSmoothed) {
  const TriangleMesh torus = testing::make_torus(30, 20);
  Received received(torus, testing::paired_source_faces(torus));
  received.refine_all();
  const std::uint32_t size = received.asset.index->polygons.size_bytes;
  const std::vector<std::byte> nonsense(size, std::byte{0xA5});
  ASSERT_TRUE(received.live->add_segment(received.asset.index->polygon_cell(), 0, nonsense));
  SilhouetteSmoother smoother({});
  const Result<SmoothedMesh> done = smoother.smooth(*received.live, view_of(torus.positions));
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_NE(done->report.limitation.find("polygons"), std::string::npos);
  EXPECT_EQ(done->report.depth, 0U);
}

// Partly refined: no cracks, and every triangle of a face that is not eligible is there as it was, but for corners that
// refined faces share, all of which are between finest faces.
TEST(SilhouetteSmoother, PartlyRefinedMeshesStayWatertightAndTheirCoarseFacesAsTheyAre) {
  const TriangleMesh ball = testing::make_sphere(40, 50);
  const TriangleMesh terrain = testing::make_terrain(40, 36, 3);
  std::size_t refined = 0;
  for (const auto& [mesh, faces] :
       {std::pair(ball, std::vector<std::uint32_t>{}), std::pair(terrain, testing::paired_source_faces(terrain))}) {
    Received received(mesh, faces);
    if (!faces.empty()) received.take_polygons();
    SilhouetteSmoother smoother({});
    SeededRandom random(11);
    for (int round = 0; round < 10; ++round) {
      SCOPED_TRACE(round);
      std::vector<CellTarget> targets;
      for (std::uint32_t c = 0; c < received.asset.index->cells.size(); ++c) {
        if (random.one_in(3)) targets.push_back({c, random.one_in(5) ? 1 : ProgressiveMesh::kEverySegment});
      }
      (void)received.live->move_to(targets);
      const TriangleMesh before = received.live->triangle_mesh();
      const View view = view_of(mesh.positions, {random.unit() - 0.5, random.unit() - 0.5, 1.0});
      const Result<SmoothedMesh> done = smoother.smooth(*received.live, view);
      ASSERT_TRUE(done) << done.error().message;
      std::string why;
      ASSERT_TRUE(is_oriented_manifold(done->mesh, &why)) << why;
      ASSERT_EQ(testing::topology_of(done->mesh), testing::topology_of(before));
      refined += done->report.faces_after - done->report.faces_before;
      // What has moved, has done so between finest faces.
      std::vector<std::uint8_t> moved(before.positions.size(), 0);
      for (std::size_t v = 0; v < moved.size(); ++v) moved[v] = done->mesh.positions[v] != before.positions[v] ? 1 : 0;
      const FanState& state = received.live->state();
      const std::vector<VertexId> vertices = received.live->vertices_in_order();
      for (std::size_t n = 0; n < vertices.size(); ++n) {
        if (moved[n] == 0) continue;
        EXPECT_EQ(state.vertices[vertices[n]].context.next, kNeverSplit);
        state.fans.for_each_neighbour(vertices[n],
                                      [&](VertexId w) { EXPECT_EQ(state.vertices[w].context.next, kNeverSplit); });
      }
    }
  }
  EXPECT_GT(refined, 1000U);
}

}  // namespace
}  // namespace fanstream
