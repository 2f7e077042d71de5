// Which triangles are of one face of the source, from the file through cleaning.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "tests/support/drawn_triangles.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_sources.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

ImportedMesh import_text(const std::string& text, const std::string& name) {
  auto imported = import_mesh_from_memory(text, name);
  EXPECT_TRUE(imported) << imported.error().message;
  return imported ? std::move(*imported) : ImportedMesh{};
}

TEST(SourceFaces, AreThoseOfAPolygonFormatsFile) {
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nv 3 0 0\n"
      "f 1 2 3 4\nf 2 5 3\nf 5 7 6 3\n";
  EXPECT_EQ(import_text(obj, "x.obj").source_faces, (std::vector<std::uint32_t>{0, 1, 1, 2, 2}));
  const std::string off = "OFF\n5 1 0\n0 0 0\n1 0 0\n1 1 0\n0.5 1.5 0\n0 1 0\n5 0 1 2 3 4\n";
  EXPECT_EQ(import_text(off, "x.off").source_faces, (std::vector<std::uint32_t>{0, 0, 0}));
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
  EXPECT_EQ(import_text(ply, "x.ply").source_faces, (std::vector<std::uint32_t>{0, 0}));
}

TEST(SourceFaces, AreNoneWhereAllFacesAreTriangles) {
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
  EXPECT_TRUE(import_text(obj, "x.obj").source_faces.empty());
  EXPECT_TRUE(clean_mesh(testing::make_torus(5, 4)).source_faces.empty());
}

TEST(SourceFaces, AFileOfPolygonsComesBackAsThem) {
  const TriangleMesh torus = testing::make_torus(8, 6);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<std::uint32_t> faces = testing::random_source_faces(torus, 4, seed);
    ImportedMesh imported = import_text(testing::obj_text(torus, faces), "x.obj");
    const CleanedMesh cleaned = clean_mesh(std::move(imported.mesh), std::move(imported.source_faces));
    EXPECT_EQ(testing::source_polygons(cleaned.mesh, cleaned.source_faces), testing::source_polygons(torus, faces));
  }
}

// Bad meshes of all kinds: each triangle that is left is one of its face's, whatever was welded, dropped, flipped or
// split around it.
TEST(SourceFaces, GoWithTheirTrianglesThroughCleaning) {
  const auto key = [](const TriangleMesh& mesh, const Triangle& t) {
    std::array<std::array<double, 3>, 3> places{};
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& p = mesh.positions[t[k]];
      places[k] = {p.x + 0.0, p.y + 0.0, p.z + 0.0};
    }
    std::sort(places.begin(), places.end());
    return places;
  };
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    TriangleMesh soup = seed % 4 == 0 ? testing::make_moebius(7) : testing::make_random_soup(9, 30, seed, true);
    if (seed % 4 == 1) soup = testing::explode(testing::make_book(5));
    SeededRandom random(seed);
    std::vector<std::uint32_t> faces(soup.triangles.size());
    for (std::uint32_t t = 0; t < faces.size(); ++t) faces[t] = t / 3;
    std::map<std::array<std::array<double, 3>, 3>, std::set<std::uint32_t>> given;
    for (std::size_t t = 0; t < faces.size(); ++t) given[key(soup, soup.triangles[t])].insert(faces[t]);
    const CleanedMesh cleaned = clean_mesh(soup, faces);
    const CleanedMesh without = clean_mesh(soup);
    EXPECT_EQ(cleaned.mesh.triangles, without.mesh.triangles);
    EXPECT_EQ(cleaned.report, without.report);
    ASSERT_EQ(cleaned.source_faces.size(), cleaned.mesh.triangles.size());
    for (std::size_t t = 0; t < cleaned.source_faces.size(); ++t) {
      EXPECT_EQ(given[key(cleaned.mesh, cleaned.mesh.triangles[t])].count(cleaned.source_faces[t]), 1U);
    }
  }
}

TEST(SourceFaces, AQuadWithTwoCornersInOnePlaceIsATriangle) {
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv 2 2 0\nf 1 2 3 4\nf 2 5 6 4\n";
  ImportedMesh imported = import_text(obj, "x.obj");
  const CleanedMesh cleaned = clean_mesh(std::move(imported.mesh), std::move(imported.source_faces));
  EXPECT_EQ(cleaned.mesh.triangles.size(), 3U);
  EXPECT_EQ(testing::source_polygons(cleaned.mesh, cleaned.source_faces).size(), 1U);
}

}  // namespace
}  // namespace fanstream
