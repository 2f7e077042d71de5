#include "common/mesh/polygon_cleaner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "client/subdivide/subdivision.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/polygon_meshes.h"
#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

TEST(PolygonCleaner, LeavesCleanMeshesAlone) {
  for (const PolygonMesh& mesh :
       {make_cube(), with_dissolved_edges(polygon_mesh(make_terrain(7, 5, 1)), 0.4, 1), dual_of(make_sphere(6, 9))}) {
    PolygonMesh cleaned = mesh;
    EXPECT_EQ(clean_polygons(cleaned), PolygonRepairs{});
    EXPECT_EQ(cleaned.points, mesh.points);
    EXPECT_EQ(cleaned.corners, mesh.corners);
    EXPECT_EQ(cleaned.face_begins, mesh.face_begins);
  }
}

TEST(PolygonCleaner, WeldsWhatFilesStoreFaceByFace) {
  const PolygonMesh mesh = make_cube();
  PolygonMesh soup;
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    std::vector<VertexId> face;
    for (const VertexId v : mesh.face(f)) {
      face.push_back(static_cast<VertexId>(soup.points.size()));
      soup.points.push_back(mesh.points[v]);
    }
    soup.add_face(face);
  }
  soup.points.emplace_back(9, 9, 9, 1);
  const PolygonRepairs repairs = clean_polygons(soup);
  EXPECT_EQ(repairs.welded_vertices, 16U);
  EXPECT_EQ(repairs.unreferenced_vertices, 1U);
  EXPECT_EQ(soup.points.size(), 8U);
  EXPECT_EQ(uniform_face_count(soup, 1), 12U);  // closed
}

TEST(PolygonCleaner, RepeatedCornersAreDroppedAndLoopsCut) {
  PolygonMesh mesh = make_quad_grid(3, 1);
  mesh.corners.clear();
  mesh.face_begins = {0};
  mesh.add_face(std::array<VertexId, 5>{0, 1, 1, 5, 4});        // a repeat
  mesh.add_face(std::array<VertexId, 5>{1, 2, 6, 5, 1});        // closed as some programs do
  mesh.add_face(std::array<VertexId, 3>{2, 3, 2});              // nothing
  mesh.add_face(std::array<VertexId, 7>{2, 3, 7, 2, 7, 6, 2});  // two loops in one
  const PolygonRepairs repairs = clean_polygons(mesh);
  EXPECT_EQ(repairs.repeated_corners, 1U);
  EXPECT_EQ(repairs.degenerate_faces, 1U);
  EXPECT_EQ(repairs.cut_faces, 1U);
  ASSERT_EQ(mesh.face_count(), 4U);
  EXPECT_EQ(mesh.face(0).size(), 4U);
  EXPECT_EQ(mesh.face(1).size(), 4U);
  EXPECT_EQ(mesh.face(2).size(), 3U);
  EXPECT_EQ(mesh.face(3).size(), 3U);
  EXPECT_TRUE(check_polygons(mesh));
}

TEST(PolygonCleaner, WindingsAgreeAsMostHadThem) {
  const PolygonMesh mesh = with_dissolved_edges(polygon_mesh(make_sphere(8, 12)), 0.3, 4);
  PolygonMesh mixed = mesh;
  for (FaceId f = 0; f < mesh.face_count(); f += 3) {
    std::reverse(mixed.corners.begin() + mesh.face_begins[f], mixed.corners.begin() + mesh.face_begins[f + 1]);
  }
  const PolygonRepairs repairs = clean_polygons(mixed);
  EXPECT_EQ(repairs.flipped_faces, (mesh.face_count() + 2) / 3);
  EXPECT_EQ(repairs.opened_edges, 0U);
  EXPECT_EQ(mixed.corners, mesh.corners);
}

TEST(PolygonCleaner, OpensWhatIsNoSurface) {
  PolygonMesh book = polygon_mesh(make_book(3));
  EXPECT_EQ(clean_polygons(book).opened_edges, 1U);
  PolygonMesh bowtie = polygon_mesh(make_bowtie(4));
  EXPECT_EQ(clean_polygons(bowtie).split_vertices, 1U);
  PolygonMesh moebius = polygon_mesh(make_moebius(9));
  EXPECT_EQ(clean_polygons(moebius).opened_edges, 1U);
  PolygonMesh twice = make_cube();
  twice.add_face(std::array<VertexId, 4>{0, 1, 3, 2});
  EXPECT_EQ(clean_polygons(twice).duplicate_faces, 1U);
  for (const PolygonMesh& mesh : {book, bowtie, moebius, twice}) EXPECT_TRUE(check_polygons(mesh));
}

TEST(PolygonCleaner, WhateverComesInCanBeSubdivided) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SeededRandom random(seed);
    PolygonMesh mesh;
    const std::uint32_t vertices = 4 + random.below(30);
    for (std::uint32_t v = 0; v < vertices; ++v) {
      mesh.points.emplace_back(random.below(4), random.below(4), random.below(4), 1 + random.below(2));
    }
    for (std::uint32_t f = 0; f < 5 + random.below(60); ++f) {
      std::vector<VertexId> face(random.below(8));
      for (VertexId& v : face) v = random.below(vertices);
      mesh.add_face(face);
    }
    clean_polygons(mesh);
    const Result<void> checked = check_polygons(mesh);
    ASSERT_TRUE(checked) << "seed " << seed << ": " << checked.error().message;
    const std::set<VertexId> used(mesh.corners.begin(), mesh.corners.end());
    ASSERT_EQ(used.size(), mesh.points.size()) << "seed " << seed;
    ASSERT_TRUE(subdivide(mesh, 3)) << "seed " << seed;
  }
}

}  // namespace
}  // namespace fanstream
