// What is particular to PLY, STL, OBJ and OFF.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <initializer_list>

#include "common/import/mesh_import.h"
#include "tests/support/drawn_triangles.h"
#include "tests/support/mesh_files.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

TriangleMesh import_text(const std::string& text, const std::string& name) {
  const Result<ImportedMesh> imported = import_mesh_from_memory(text, name);
  EXPECT_TRUE(imported) << imported.error().message;
  return imported ? imported->mesh : TriangleMesh{};
}

std::string error_of(const std::string& text, const std::string& name) {
  const Result<ImportedMesh> imported = import_mesh_from_memory(text, name);
  return imported ? "no error" : imported.error().message;
}

std::string only_warning_of(const std::string& text, const std::string& name) {
  const Result<ImportedMesh> imported = import_mesh_from_memory(text, name);
  if (!imported) return imported.error().message;
  return imported->warnings.size() == 1 ? imported->warnings[0]
                                        : std::to_string(imported->warnings.size()) + " warnings";
}

const std::vector<glm::dvec3> kCorners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const std::vector<Triangle> kQuad = {{0, 1, 2}, {0, 2, 3}};

TEST(Ply, ReadsAnyElementsPropertiesAndOrder) {
  const TriangleMesh mesh = import_text(
      "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nobj_info 12 34\r\n"
      "element material 2\r\nproperty uchar red\r\nproperty list uchar float shine\r\n"
      "element face 1\r\nproperty int flags\r\nproperty list uint8 uint32 vertex_index\r\nproperty list uchar float "
      "texcoord\r\n"
      "element nothing 99999999999\r\n"
      "element vertex 4\r\nproperty list uchar int tags\r\nproperty float z\r\nproperty uchar red\r\nproperty short "
      "y\r\n"
      "property float64 x\r\nend_header\r\n"
      "255 0\r\n17 2 0.5 1e3\r\n"
      "-7 4 0 1 2 3 2 0.25 0.75\r\n"
      "0 0 9 0 0\r\n1 5 0 9 0 1\r\n0 0 9 1 1.0\r\n0 0 9 1 +0\r\n",
      "a.ply");
  EXPECT_EQ(mesh.positions, kCorners);
  EXPECT_EQ(mesh.triangles, kQuad);
}

TEST(Ply, ReadsEveryBinaryTypeInBothByteOrders) {
  for (const bool big : {false, true}) {
    std::string bytes =
        std::string("ply\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") +
        " 1.0\nelement vertex 4\nproperty short x\nproperty int8 y\nproperty float z\nproperty uint w\n"
        "element face 1\nproperty list ushort ushort vertex_indices\nproperty double area\nend_header\n";
    const auto put = [&](auto value) {
      char raw[sizeof value];
      std::memcpy(raw, &value, sizeof value);
      if (big) std::reverse(raw, raw + sizeof value);
      bytes.append(raw, sizeof value);
    };
    const short x[] = {-300, 300, 300, -300};
    for (int i = 0; i < 4; ++i) {
      put(x[i]);
      put(static_cast<std::int8_t>(i < 2 ? -5 : 5));
      put(0.5F);
      put(4000000000U);
    }
    put(std::uint16_t{4});
    for (const std::uint16_t index : {0, 1, 2, 3}) put(index);
    put(1.5);
    const TriangleMesh mesh = import_text(bytes, "a.ply");
    EXPECT_EQ(mesh.positions,
              (std::vector<glm::dvec3>{{-300, -5, 0.5}, {300, -5, 0.5}, {300, 5, 0.5}, {-300, 5, 0.5}}));
    EXPECT_EQ(mesh.triangles, kQuad);
  }
}

TEST(Ply, ReadsTriangleStripsWithRestarts) {
  const TriangleMesh mesh = import_text(
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n9 0 1 2 3 4 -1 4 1 0\n",
      "strips.ply");
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 1, 0}}));
}

const std::string kPlyHead =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kPlyFaces = "element face 1\nproperty list uchar int vertex_indices\n";
const std::string kPlyCorners = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

TEST(Ply, ErrorsNameLineOrByteAndElement) {
  EXPECT_EQ(error_of(kPlyHead + kPlyFaces + "end_header\n" + kPlyCorners + "4 0 1 2 4\n", "a.ply"),
            "a.ply: line 14: face 0: corner 3 names vertex 4, but there are 4 vertices");
  EXPECT_EQ(error_of(kPlyHead + kPlyFaces + "end_header\n0 0 0\n1 x 0\n1 1 0\n0 1 0\n4 0 1 2 3\n", "a.ply"),
            "a.ply: line 11: vertex 1: y is not a number: 'x'");
  EXPECT_EQ(error_of(kPlyHead + kPlyFaces + "end_header\n" + kPlyCorners + "4 0 1 2\n", "a.ply"),
            "a.ply: line 15: face 0: corner 3 is missing: the file ends here, it may be truncated");
  const std::string binary = ply_binary(make_tetrahedron(), false);
  EXPECT_EQ(error_of(binary.substr(0, binary.size() - 1), "a.ply"),
            "a.ply: byte " + std::to_string(binary.size() - 12) +
                ": face 3 claims 3 corners, but only 11 bytes follow: the file is truncated or damaged");
  EXPECT_EQ(error_of("ply\nformat ascii 2.0\n", "a.ply"), "a.ply: line 2: unknown PLY version '2.0': 1.0 expected");
  EXPECT_EQ(error_of("ply\nformat ascii 1.0\nelement vertex -3\n", "a.ply"),
            "a.ply: line 3: the number of elements is negative");
  EXPECT_EQ(error_of("ply\nformat ascii 1.0\nelement vertex 99999999999999999999\n", "a.ply"),
            "a.ply: line 3: the number of elements '99999999999999999999' is too large");
}

TEST(Ply, CountsBeyondTheFileAreRefusedBeforeMemoryIsTaken) {
  for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const char* count : {"1000000000000000000", "400000000"}) {
      const std::string head = std::string("ply\nformat ") + encoding + " 1.0\nelement vertex ";
      const std::string axes = "\nproperty float x\nproperty float y\nproperty float z\n";
      const std::string vertices = error_of(head + count + axes + kPlyFaces + "end_header\n0 0 0\n", "a.ply");
      EXPECT_TRUE(vertices.find("more than the limit") != std::string::npos ||
                  vertices.find("the header promises") != std::string::npos)
          << vertices;
      const std::string faces = error_of(
          head + "0" + axes + "element face " + count + "\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n",
          "a.ply");
      EXPECT_NE(faces.find("the header promises"), std::string::npos) << faces;
    }
  }
  EXPECT_NE(error_of(kPlyHead + "element face 1\nproperty list int int vertex_indices\nend_header\n" + kPlyCorners +
                         "2000000000 0 1 2\n",
                     "a.ply")
                .find("claims 2000000000 corners"),
            std::string::npos);
}

TEST(Ply, NumbersBeyondDoublesAreToldFromTinyOnes) {
  const std::string head = kPlyHead + kPlyFaces + "end_header\n";
  EXPECT_EQ(import_text(head + "1e-400 -1e-999 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n", "a.ply").positions[0],
            glm::dvec3(0));
  EXPECT_EQ(error_of(head + "1e400 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n", "a.ply"),
            "a.ply: line 10: vertex 0: x '1e400' is too large");
}

TEST(Ply, PointCloudsHaveNoTriangles) {
  EXPECT_EQ(error_of(kPlyHead + "end_header\n" + kPlyCorners, "a.ply"),
            "a.ply: the PLY file has no triangles: points and lines cannot be streamed");
}

TEST(Stl, TextAndBinaryAreToldApartByMoreThanTheFirstWord) {
  const TriangleMesh mesh = in_float_precision(make_sphere(4, 5));
  const std::string binary = stl_binary(mesh);
  ASSERT_TRUE(binary.starts_with("solid"));
  EXPECT_EQ(drawn_triangles(import_text(binary, "a.stl")), drawn_triangles(mesh));
  EXPECT_EQ(drawn_triangles(import_text(stl_text(mesh), "a.stl")), drawn_triangles(mesh));
  EXPECT_EQ(only_warning_of(binary + "abc", "a.stl"),
            "Byte " + std::to_string(binary.size()) + ": 3 bytes behind the last facet were ignored.");
  EXPECT_EQ(drawn_triangles(import_text(binary + "abc", "a.stl")), drawn_triangles(mesh));
}

TEST(Stl, TextMayHaveSeveralSolidsAnyCaseAndNoNames) {
  const TriangleMesh mesh = import_text(
      "solid\nFACET NORMAL 0 0 1 OUTER LOOP VERTEX 0 0 0 VERTEX 1 0 0 VERTEX 1 1 0 ENDLOOP ENDFACET\nendsolid\n"
      "solid second one\r\nfacet normal 0 0 1\r\nouter loop\r\nvertex 0 0 0\r\nvertex 1 1 0\r\nvertex 0 1 "
      "0\r\nendloop\r\n"
      "endfacet\r\nendsolid second one\r\n",
      "a.stl");
  EXPECT_EQ(drawn_triangles(mesh), drawn_triangles({kCorners, kQuad}));
}

TEST(Stl, TextErrorsNameTheLineAndTheWord) {
  EXPECT_EQ(error_of("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid\n",
                     "a.stl"),
            "a.stl: line 7: the facet has 2 corners");
  EXPECT_EQ(error_of("solid\nfacet normal 0 0 1\nouter lop\n", "a.stl"),
            "a.stl: line 3: 'loop' expected, but 'lop' found");
}

TEST(Stl, ACountBeyondTheFileIsRefused) {
  std::string bytes(80, ' ');
  bytes += std::string("\xFF\xFF\xFF\xFF", 4) + std::string(100, '\0');
  EXPECT_EQ(
      error_of(bytes, "a.stl"),
      "a.stl: byte 80: the header promises 4294967295 facets, but the file holds 2: it is truncated, or not a mesh");
}

TEST(Obj, ReadsEveryFormOfFace) {
  for (const char* faces :
       {"f 1 2 3\nf 1 3 4\n", "f 1/1 2/2 3/3\nf 1/1 3/1 4/2\n", "f 1//1 2//1 3//1\nf 1//1 3//1 4//1\n",
        "f 1/5/1 2/6/1 3/7/1\nf -4 -2 -1\n", "f 1 2 3 4\n", "f -4/-4 -3/-3 -2/-2 -1/-1\n", "f 1 2 \\\n 3 \\\r\n 4\n",
        "  f\t1 2 3 4  # a quad\n", "fo 1 2 3 4\n"}) {
    const TriangleMesh mesh = import_text(
        "# by hand\r\nmtllib a.mtl\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
        "g a\nusemtl m\ns 1\n" +
            std::string(faces),
        "a.obj");
    EXPECT_EQ(mesh.positions, kCorners);
    EXPECT_EQ(mesh.triangles, kQuad) << faces;
  }
}

TEST(Obj, FacesMayComeBeforeTheirVertices) {
  EXPECT_EQ(import_text("f 1 2 3 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n", "a.obj").triangles, kQuad);
  EXPECT_EQ(error_of("v 0 0 0\nf 1 2 3\nf 1 2 7\nf 1 2 4\nv 1 0 0\nv 1 1 0\nv 0 1 0\n", "a.obj"),
            "a.obj: line 3: the face names vertex 7, but the file has 4 vertices");
}

TEST(Obj, BadCornersAreNamedWithTheirLine) {
  const std::string head = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
  EXPECT_EQ(error_of(head + "f 1 2 0\n", "a.obj"),
            "a.obj: line 4: the face names vertex 0, but 3 vertices come before it");
  EXPECT_EQ(error_of(head + "f 1 2 -4\n", "a.obj"),
            "a.obj: line 4: the face names vertex -4, but 3 vertices come before it");
  EXPECT_EQ(error_of(head + "f 1 2 3x\n", "a.obj"),
            "a.obj: line 4: a corner must begin with a vertex number, but is '3x'");
  EXPECT_EQ(error_of(head + "f 1 2 99999999999999999999\n", "a.obj"),
            "a.obj: line 4: a corner must begin with a vertex number, but is '99999999999999999999'");
  EXPECT_EQ(error_of("v 0 nan 0\n", "a.obj"), "a.obj: line 1: vertex 1 has a coordinate that is not a number (NaN)");
  EXPECT_EQ(error_of("v 0 0\nv 1 0 0\n", "a.obj"), "a.obj: line 1: vertex 1: a coordinate is missing");
}

TEST(Obj, WhatIsNotGeometryIsMentionedOnlyIfItIsOdd) {
  const std::string mesh = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
  EXPECT_EQ(only_warning_of(mesh + "hello world\nagain\n", "a.obj"),
            "Line 5: the unknown keyword 'hello' and 1 other such lines were ignored.");
  EXPECT_EQ(only_warning_of(mesh + "f 1 2\n", "a.obj"), "1 faces of fewer than three corners were ignored.");
  EXPECT_EQ(only_warning_of(mesh + "curv 0 1 1 2\n", "a.obj"),
            "1 lines of free-form curves and surfaces were ignored.");
}

TEST(Off, ReadsVariantsCommentsAndColors) {
  const std::string faces = "4 0 1 2 3 255 0 0\n";
  for (const std::string& text : std::initializer_list<std::string>{
           "OFF\n4 1 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + faces, "OFF 4 1 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + faces,
           "# first\nOFF # second\n\n4 1\n# third\n0 0 0 # fourth\n\n1 0 0\n1 1 0\n0 1 0\n" + faces,
           "COFF\n4 1 0\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n1 1 0 1 1 1 1\n0 1 0 1 1 1 1\n" + faces,
           "NOFF\r\n4 1 0\r\n0 0 0 0 0 1\r\n1 0 0 0 0 1\r\n1 1 0 0 0 1\r\n0 1 0 0 0 1\r\n4 0 1 2 3\r\n",
           "4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + faces,  // the keyword is optional
       }) {
    const TriangleMesh mesh = import_text(text, "a.off");
    EXPECT_EQ(mesh.positions, kCorners) << text;
    EXPECT_EQ(mesh.triangles, kQuad) << text;
  }
}

TEST(Off, ErrorsNameTheLine) {
  EXPECT_EQ(error_of("OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 3\n", "a.off"),
            "a.off: line 6: face 0: corner 2 names vertex 3, but there are 3 vertices");
  EXPECT_EQ(error_of("OFF\n3 1 0\n0 0 0\n1 0\n1 1 0\n3 0 1 2\n", "a.off"),
            "a.off: line 4: vertex 1: a coordinate is missing");
  EXPECT_NE(error_of("OFF\n900000000 900000000 0\n0 0 0\n", "a.off").find("the header promises"), std::string::npos);
  EXPECT_NE(error_of("4OFF\n1 1 0\n0 0 0 1\n3 0 0 0\n", "a.off").find("convert to OFF"), std::string::npos);
  EXPECT_NE(error_of("OFF BINARY\n", "a.off").find("binary OFF"), std::string::npos);
}

TEST(TextFormats, AByteOrderMarkIsSkipped) {
  const std::string mark = "\xEF\xBB\xBF";
  for (const auto& [text, file] : {std::pair{obj_text(make_tetrahedron()), "a.obj"},
                                   {off_text(make_tetrahedron()), "a.off"},
                                   {ply_text(make_tetrahedron()), "a.ply"},
                                   {stl_text(make_tetrahedron()), "a.stl"}}) {
    EXPECT_EQ(import_text(mark + text, file).triangles.size(), 4U) << file;
  }
}

}  // namespace
}  // namespace fanstream
