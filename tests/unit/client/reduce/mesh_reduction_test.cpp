#include "client/reduce/mesh_reduction.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <set>

#include "common/geometry/mesh_distance.h"
#include "common/import/attribute_transfer.h"
#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "common/mesh/manifold_check.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/shared_data.h"

namespace fanstream {
namespace {

std::vector<ReducedLevel> levels_of(const TriangleMesh& mesh, const std::vector<std::size_t>& counts,
                                    const CornerAttributes& attributes = {}, const ReductionOptions& options = {}) {
  std::vector<ReducedLevel> levels;
  const auto reduced = reduce_mesh(mesh, attributes, counts, options, [&](ReducedLevel&& level) {
    levels.push_back(std::move(level));
    return Result<void>();
  });
  EXPECT_TRUE(reduced) << reduced.error().message;
  return levels;
}

Error error_of(const TriangleMesh& mesh, const std::vector<std::size_t>& counts,
               const CornerAttributes& attributes = {}, const ReductionOptions& options = {}) {
  const auto reduced = reduce_mesh(mesh, attributes, counts, options, [](ReducedLevel&&) { return Result<void>(); });
  EXPECT_FALSE(reduced);
  return reduced ? Error{} : reduced.error();
}

void expect_manifold(const TriangleMesh& mesh) {
  std::string why;
  EXPECT_TRUE(is_oriented_manifold(mesh, &why)) << why;
}

// Attributes by a function of the position and the triangle: wedges of their own for every corner.
template <class Function>
CornerAttributes attributes_by(const TriangleMesh& mesh, Function function) {
  CornerAttributes attributes;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle wedges{};
    for (std::size_t i = 0; i < 3; ++i) {
      wedges[i] = static_cast<VertexId>(attributes.values.texture_coordinates.size());
      attributes.values.texture_coordinates.push_back(
          function(mesh.positions[mesh.triangles[t][i]], mesh.triangles[t]));
    }
    attributes.wedges.push_back(wedges);
  }
  return attributes;
}

TEST(MeshReduction, CountsAreReachedExactlyOrOneBelow) {
  for (const TriangleMesh& mesh : {testing::make_sphere(24, 40), testing::make_torus(30, 20),
                                   testing::make_terrain(30, 25, 7), testing::make_open_cylinder(30, 20)}) {
    const auto levels = levels_of(mesh, {900, 500, 333, 100, 51});
    ASSERT_EQ(levels.size(), 5U);
    for (const ReducedLevel& level : levels) {
      EXPECT_TRUE(level.reached()) << level.shortfall;
      EXPECT_LE(level.mesh.triangles.size(), level.asked_triangles);
      EXPECT_GE(level.mesh.triangles.size() + 1, level.asked_triangles);
      expect_manifold(level.mesh);
      EXPECT_TRUE(level.attributes.empty());
    }
  }
}

TEST(MeshReduction, ACountThatIsNotExceededGivesTheMeshAsItIs) {
  const TriangleMesh mesh = testing::make_torus(12, 8);
  const auto levels = levels_of(mesh, {100'000, mesh.triangles.size(), 100});
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_TRUE(levels[i].reached());
    EXPECT_EQ(levels[i].mesh.positions, mesh.positions);
    EXPECT_EQ(levels[i].mesh.triangles, mesh.triangles);
  }
  EXPECT_EQ(levels[2].mesh.triangles.size(), 100U);
}

TEST(MeshReduction, TheSameMeshGivesTheSameLevelsHoweverFarThePassGoes) {
  const TriangleMesh mesh = testing::make_terrain(40, 40, 3);
  const auto together = levels_of(mesh, {1500, 700, 200});
  const auto again = levels_of(mesh, {1500, 700});
  ASSERT_EQ(together.size(), 3U);
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_EQ(together[i].mesh.positions, again[i].mesh.positions);
    EXPECT_EQ(together[i].mesh.triangles, again[i].mesh.triangles);
  }
}

TEST(MeshReduction, TopologyStaysAndWhatCannotBeReachedIsExplained) {
  TriangleMesh mesh = testing::make_torus(20, 12);
  testing::append(mesh, testing::make_sphere(8, 12), {4.0, 0.0, 0.0});
  testing::append(mesh, testing::make_grid(5, 5), {8.0, 0.0, 0.0});
  const auto levels = levels_of(mesh, {200, 10, 5});
  ASSERT_EQ(levels.size(), 3U);
  EXPECT_TRUE(levels[0].reached());
  for (const std::size_t i : {1U, 2U}) {
    const ReducedLevel& level = levels[i];
    EXPECT_FALSE(level.reached());
    EXPECT_GT(level.mesh.triangles.size(), level.asked_triangles);
    EXPECT_NE(level.shortfall.find("would change the topology"), std::string::npos) << level.shortfall;
    expect_manifold(level.mesh);
    EXPECT_EQ(count_components(level.mesh.positions.size(), level.mesh.triangles), 3U);
  }
  EXPECT_EQ(levels[1].mesh.triangles, levels[2].mesh.triangles);
}

TEST(MeshReduction, ABoundaryOfAFlatSquareStaysASquare) {
  const TriangleMesh mesh = testing::make_grid(24, 24);
  for (const ReducedLevel& level : levels_of(mesh, {400, 100, 20})) {
    double area = 0.0;
    for (const Triangle& t : level.mesh.triangles) {
      const glm::dvec3 a = level.mesh.positions[t[0]];
      const glm::dvec3 n = glm::cross(level.mesh.positions[t[1]] - a, level.mesh.positions[t[2]] - a);
      EXPECT_GT(n.z, 0.0) << "a triangle is turned over";
      area += 0.5 * n.z;
    }
    EXPECT_NEAR(area, 576.0, 1e-6) << level.asked_triangles;
  }
}

TEST(MeshReduction, TextureCoordinatesFollowTheirVertexOnTheEdge) {
  // Of a function that is linear in the position, interpolation by the same k gives the function again, wherever the
  // vertices go; by any other k it does not.
  const TriangleMesh mesh = testing::make_terrain(30, 30, 5);
  const auto uv_of = [](const glm::dvec3& p) {
    return glm::dvec2(0.03 * p.x + 0.2 * p.z, 1.0 - 0.02 * p.y + 0.1 * p.z);
  };
  CornerAttributes attributes = attributes_by(mesh, [&](const glm::dvec3& p, const Triangle&) { return uv_of(p); });
  for (const glm::dvec2& uv : attributes.values.texture_coordinates) {
    const auto part = static_cast<float>(uv.x);
    attributes.values.colors.emplace_back(part, 2.0F * part, 1.0F - part, 1.0F);
  }
  std::size_t moved = 0;
  std::set<std::array<double, 3>> original;
  for (const glm::dvec3& p : mesh.positions) original.insert({p.x, p.y, p.z});
  for (const ReducedLevel& level : levels_of(mesh, {1000, 300, 60}, attributes)) {
    EXPECT_TRUE(level.reached()) << level.shortfall;
    const VertexAttributedMesh split = split_at_seams(level.mesh, level.attributes);
    EXPECT_EQ(split.mesh.positions.size(), level.mesh.positions.size()) << "there is no seam";
    for (std::size_t v = 0; v < split.mesh.positions.size(); ++v) {
      const glm::dvec3& p = split.mesh.positions[v];
      const glm::dvec2 expected = uv_of(p);
      EXPECT_NEAR(split.attributes.texture_coordinates[v].x, expected.x, 1e-9);
      EXPECT_NEAR(split.attributes.texture_coordinates[v].y, expected.y, 1e-9);
      EXPECT_NEAR(split.attributes.colors[v].g, 2.0 * expected.x, 1e-5);
      moved += original.contains({p.x, p.y, p.z}) ? 0 : 1;
    }
  }
  EXPECT_GT(moved, 100U) << "most vertices lie inside edges";
}

// Seams of a terrain cut into four by x and y, each quarter with coordinates of its own.
struct Quarters {
  TriangleMesh mesh = testing::make_terrain(24, 24, 9);
  CornerAttributes attributes =
      attributes_by(mesh, [this](const glm::dvec3& p, const Triangle& t) { return uv_of(p, quarter_of(mesh, t)); });
  static int quarter_of(const TriangleMesh& mesh, const Triangle& t) {
    const glm::dvec3 c = (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0;
    return (c.x > 12.0 ? 1 : 0) + (c.y > 12.0 ? 2 : 0);
  }
  static glm::dvec2 uv_of(const glm::dvec3& p, int quarter) {
    return {0.01 * p.x + 0.1 * p.z + quarter, 0.01 * p.y - 0.1 * p.z + 10.0 * quarter};
  }
};

TEST(MeshReduction, SeamsStayWhereTheyAreAndNoCrackOpens) {
  const Quarters quarters;
  for (const ReducedLevel& level : levels_of(quarters.mesh, {600, 200, 60}, quarters.attributes)) {
    EXPECT_TRUE(level.reached()) << level.shortfall;
    expect_manifold(level.mesh);
    std::map<VertexId, std::set<int>> quarters_at;
    for (std::size_t t = 0; t < level.mesh.triangles.size(); ++t) {
      const auto uv = [&](std::size_t i) {
        return level.attributes.values.texture_coordinates[level.attributes.wedges[t][i]];
      };
      const int quarter = static_cast<int>(std::lround(std::floor((uv(0).y + 5.0) / 10.0)));
      for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec2 expected = Quarters::uv_of(level.mesh.positions[level.mesh.triangles[t][i]], quarter);
        EXPECT_NEAR(uv(i).x, expected.x, 1e-9) << "triangle " << t << " mixes quarters";
        EXPECT_NEAR(uv(i).y, expected.y, 1e-9);
        quarters_at[level.mesh.triangles[t][i]].insert(quarter);
      }
    }
    // Positions are shared: a seam vertex lies on the seam, and all four meet in one point still.
    std::size_t on_seams = 0;
    bool all_meet = false;
    for (const auto& [v, around] : quarters_at) {
      on_seams += around.size() > 1 ? 1 : 0;
      all_meet = all_meet || around.size() == 4;
      if (around.size() < 2) continue;
      const glm::dvec3& p = level.mesh.positions[v];
      EXPECT_TRUE(std::abs(p.x - 12.0) < 1e-9 || std::abs(p.y - 12.0) < 1e-9) << p.x << " " << p.y;
    }
    EXPECT_TRUE(all_meet);
    EXPECT_GT(on_seams, 4U);
    // A file with a vertex for each wedge welds back to the same surface.
    const VertexAttributedMesh split = split_at_seams(level.mesh, level.attributes);
    EXPECT_GT(split.mesh.positions.size(), level.mesh.positions.size());
    const CleanedMesh welded = clean_mesh(split.mesh);
    EXPECT_EQ(welded.mesh.positions.size(), level.mesh.positions.size());
    EXPECT_EQ(welded.mesh.triangles.size(), level.mesh.triangles.size());
    EXPECT_EQ(welded.report.split_edges, 0U);
  }
}

TEST(MeshReduction, ACrowdedSeamHoldsItsVerticesAndSaysSo) {
  // Every triangle has a chart of its own: no vertex can follow another's coordinates.
  const TriangleMesh mesh = testing::make_torus(12, 8);
  int next = 0;
  std::map<Triangle, int> charts;
  const CornerAttributes attributes = attributes_by(mesh, [&](const glm::dvec3&, const Triangle& t) {
    return glm::dvec2(charts.try_emplace(t, next++).first->second, 0.0);
  });
  const auto levels = levels_of(mesh, {50}, attributes);
  ASSERT_EQ(levels.size(), 1U);
  EXPECT_FALSE(levels[0].reached());
  EXPECT_EQ(levels[0].mesh.triangles, mesh.triangles);
  EXPECT_NE(levels[0].shortfall.find("boundary or a seam"), std::string::npos) << levels[0].shortfall;
}

TEST(MeshReduction, MeshesFarAwayLargeAndSmallReduceAlike) {
  const TriangleMesh mesh = testing::make_torus(30, 20);
  const auto plain = levels_of(mesh, {200});
  for (const double scale : {1e-30, 1e-9, 1e9, 1e29}) {
    TriangleMesh scaled = mesh;
    for (glm::dvec3& p : scaled.positions) p *= scale;
    const auto levels = levels_of(scaled, {200});
    EXPECT_EQ(levels[0].mesh.triangles.size(), plain[0].mesh.triangles.size()) << scale;
    expect_manifold(levels[0].mesh);
    for (const glm::dvec3& p : levels[0].mesh.positions) EXPECT_LT(glm::length(p / scale), 1.4);
  }
  TriangleMesh far = mesh;
  for (glm::dvec3& p : far.positions) p += glm::dvec3(1e6, -1e6, 1e6);
  const auto levels = levels_of(far, {200});
  EXPECT_EQ(levels[0].mesh.triangles.size(), 200U);
  EXPECT_LT(mesh_distance(far, levels[0].mesh)->relative_rms(),
            1.2 * mesh_distance(mesh, plain[0].mesh)->relative_rms());
}

TEST(MeshReduction, DegenerateTrianglesAndLargeStarsAreReduced) {
  TriangleMesh needles = testing::make_grid(20, 20);
  for (glm::dvec3& p : needles.positions) p.y = std::min(p.y, 10.0);  // half of the triangles have no area
  const auto flat = levels_of(needles, {300, 100});
  for (const ReducedLevel& level : flat) expect_manifold(level.mesh);
  const TriangleMesh poles = testing::make_sphere(3, 2000);  // two vertices with 2000 faces each
  const auto levels = levels_of(poles, {4000, 500});
  EXPECT_EQ(levels[1].mesh.triangles.size(), 500U);
  expect_manifold(levels[1].mesh);
  TriangleMesh point = testing::make_tetrahedron();
  for (glm::dvec3& p : point.positions) p = glm::dvec3(1.0);
  EXPECT_FALSE(levels_of(point, {2})[0].reached());
}

TEST(MeshReduction, BadInputIsRefusedWithItsPlace) {
  const TriangleMesh good = testing::make_torus(8, 6);
  const auto expect = [](const Error& error, ErrorKind kind, const std::string& text) {
    EXPECT_EQ(error.kind, kind) << error.message;
    EXPECT_NE(error.message.find(text), std::string::npos) << error.message;
  };
  expect(error_of(good, {}), ErrorKind::usage, "no number of triangles");
  expect(error_of(good, {10, 0}), ErrorKind::usage, "0 triangles");
  expect(error_of(good, {10, 10}), ErrorKind::usage, "10 triangles after 10");
  expect(error_of(good, {10, 20}), ErrorKind::usage, "20 triangles after 10");
  expect(error_of({}, {10}), ErrorKind::bad_input, "no triangles");
  TriangleMesh bad = good;
  bad.positions[5].y = std::numeric_limits<double>::quiet_NaN();
  expect(error_of(bad, {10}), ErrorKind::bad_input, "vertex 5");
  bad = good;
  bad.triangles[3][1] = 99'999;
  expect(error_of(bad, {10}), ErrorKind::bad_input, "99999");
  expect(error_of(testing::make_book(3), {2}), ErrorKind::bad_input, "oriented manifold");
  CornerAttributes attributes = attributes_by(good, [](const glm::dvec3&, const Triangle&) { return glm::dvec2(0.0); });
  CornerAttributes damaged = attributes;
  damaged.wedges.pop_back();
  expect(error_of(good, {10}, damaged), ErrorKind::bad_input, "95 of 96 triangles");
  damaged = attributes;
  damaged.wedges[7][2] = 288;
  expect(error_of(good, {10}, damaged), ErrorKind::bad_input, "triangle 7 names attributes 288 of 288");
  damaged = attributes;
  damaged.values.colors.emplace_back(1.0F);
  expect(error_of(good, {10}, damaged), ErrorKind::bad_input, "288 texture coordinates, but 1 colours");
  damaged = attributes;
  damaged.values.texture_coordinates[11].x = std::numeric_limits<double>::infinity();
  expect(error_of(good, {10}, damaged), ErrorKind::bad_input, "attributes 11");
  ReductionOptions stopping;
  stopping.go_on = [](double) { return false; };
  expect(error_of(good, {10}, {}, stopping), ErrorKind::interrupted, "stopped");
}

TEST(MeshReduction, ProgressGrowsAndTheSinksErrorEndsIt) {
  const TriangleMesh mesh = testing::make_torus(30, 20);
  double last = 0.0;
  ReductionOptions options;
  options.go_on = [&](double fraction) {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1.0);
    last = fraction;
    return true;
  };
  int taken = 0;
  const std::vector<std::size_t> counts{600, 300, 100};
  const auto reduced = reduce_mesh(mesh, {}, counts, options, [&](ReducedLevel&&) -> Result<void> {
    if (++taken == 2) return fail(ErrorKind::io, "full");
    return {};
  });
  EXPECT_FALSE(reduced);
  EXPECT_EQ(reduced.error().message, "full");
  EXPECT_EQ(taken, 2);
  EXPECT_GT(last, 0.5);
}

TEST(MeshReduction, RealModelsWithSeamsReachStrongReduction) {
  for (const char* file : {"spot_textured.glb", "duck.glb"}) {
    const auto path = testing::shared_mesh(file);
    if (path.empty()) GTEST_SKIP() << "no shared meshes";
    ImportOptions import;
    import.keep_attributes = true;
    auto imported = import_mesh(path, import);
    ASSERT_TRUE(imported) << imported.error().message;
    const TriangleMesh mesh = clean_mesh(imported->mesh).mesh;
    const CornerAttributes attributes = attributes_after_cleaning(imported->mesh, imported->attributes, mesh);
    ASSERT_FALSE(attributes.empty());
    glm::dvec2 low = attributes.values.texture_coordinates[0];
    glm::dvec2 high = low;
    for (const glm::dvec2& uv : attributes.values.texture_coordinates) {
      low = glm::min(low, uv);
      high = glm::max(high, uv);
    }
    for (const ReducedLevel& level : levels_of(mesh, {2000, 1000, 200}, attributes)) {
      EXPECT_TRUE(level.reached()) << file << ": " << level.shortfall;
      expect_manifold(level.mesh);
      for (const glm::dvec2& uv : level.attributes.values.texture_coordinates) {
        // Interpolated, so never beyond those of the source.
        EXPECT_TRUE(uv == glm::clamp(uv, low - 1e-12, high + 1e-12)) << file << ": " << uv.x << ", " << uv.y;
      }
    }
  }
}

}  // namespace
}  // namespace fanstream
