// What every format has in common: round trips, telling formats apart, limits, bad and damaged files.
#include "common/import/mesh_import.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <functional>
#include <random>

#include "common/import/mesh_cleaner.h"
#include "common/mesh/manifold_check.h"
#include "tests/support/drawn_triangles.h"
#include "tests/support/mesh_files.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using namespace fanstream::testing;

struct Format {
  const char* label;
  const char* extension;
  MeshFormat format;
  std::function<std::string(const TriangleMesh&)> write;
  bool text;
  bool keeps_indices = true;  // STL does not, Draco reorders
  bool keeps_positions = true;
};

void PrintTo(const Format& format, std::ostream* stream) { *stream << format.label; }

std::vector<Format> all_formats() {
  return {
      {"ply_text", "ply", MeshFormat::ply, ply_text, true},
      {"ply_little_endian", "ply", MeshFormat::ply, [](const auto& mesh) { return ply_binary(mesh, false); }, false},
      {"ply_big_endian", "ply", MeshFormat::ply, [](const auto& mesh) { return ply_binary(mesh, true); }, false},
      {"stl_text", "stl", MeshFormat::stl, stl_text, true, false},
      {"stl_binary", "stl", MeshFormat::stl, stl_binary, false, false},
      {"obj", "obj", MeshFormat::obj, obj_text, true},
      {"off", "off", MeshFormat::off, off_text, true},
      {"glb", "glb", MeshFormat::glb, [](const auto& mesh) { return gltf_draft(mesh).as_glb(); }, false},
      {"gltf", "gltf", MeshFormat::gltf, [](const auto& mesh) { return gltf_draft(mesh).as_gltf_with_data_uri(); },
       false},
      {"glb_draco", "glb", MeshFormat::glb, [](const auto& mesh) { return draco_gltf_draft(mesh, false).as_glb(); },
       false, false, false},
      {"glb_draco_lossless", "glb", MeshFormat::glb,
       [](const auto& mesh) { return draco_gltf_draft(mesh, true).as_glb(); }, false, false},
  };
}

class EveryFormat : public ::testing::TestWithParam<Format> {
 protected:
  Result<ImportedMesh> import(const std::string& bytes, const ImportOptions& options = {}) {
    return import_mesh_from_memory(bytes, std::string("mesh.") + GetParam().extension, options);
  }
  // A message that names the file and reads as a sentence, and a kind that the bytes of a file can cause.
  void expect_good_error(const Error& error) {
    const std::string path = std::string("mesh.") + GetParam().extension;
    EXPECT_TRUE(error.message.starts_with(path + ": ")) << error.message;
    EXPECT_GT(error.message.size(), path.size() + 12) << error.message;
    EXPECT_TRUE(error.kind == ErrorKind::bad_input || error.kind == ErrorKind::not_found ||
                error.kind == ErrorKind::unsupported || error.kind == ErrorKind::limit)
        << name(error.kind) << ": " << error.message;
  }
};

TEST_P(EveryFormat, RoundTrips) {
  TriangleMesh mesh = make_sphere(9, 14);
  append(mesh, make_terrain(6, 5, 3), {3, -7, 0.125});
  mesh = in_float_precision(mesh);
  const Result<ImportedMesh> imported = import(GetParam().write(mesh));
  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_EQ(imported->format, GetParam().format);
  EXPECT_TRUE(imported->warnings.empty()) << imported->warnings.front();
  if (GetParam().keeps_indices) {
    EXPECT_EQ(imported->mesh.positions, mesh.positions);
    EXPECT_EQ(imported->mesh.triangles, mesh.triangles);
  } else if (GetParam().keeps_positions) {
    EXPECT_EQ(drawn_triangles(imported->mesh), drawn_triangles(mesh));
  }
  const CleanedMesh cleaned = clean_mesh(imported->mesh);
  EXPECT_EQ(cleaned.mesh.positions.size(), mesh.positions.size());
  EXPECT_EQ(cleaned.mesh.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(cleaned.report.flipped_triangles, 0U);
  EXPECT_TRUE(is_oriented_manifold(cleaned.mesh));
}

TEST_P(EveryFormat, ATwoTriangleMeshRoundTrips) {
  const TriangleMesh mesh = make_grid(1, 1);
  const Result<ImportedMesh> imported = import(GetParam().write(mesh));
  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_EQ(drawn_triangles(imported->mesh), drawn_triangles(mesh));
}

TEST_P(EveryFormat, IsToldByItsContentWhateverTheExtension) {
  const std::string bytes = GetParam().write(make_tetrahedron());
  TemporaryFolder folder;
  for (const char* file : {"mesh", "mesh.dat", "mesh.off", "mesh.glb", "mesh.ply"}) {
    const Result<ImportedMesh> imported = import_mesh(folder.write(file, bytes));
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_EQ(imported->format, GetParam().format) << file;
    EXPECT_EQ(imported->mesh.triangles.size(), 4U) << file;
  }
}

TEST_P(EveryFormat, NoTrianglesIsAnError) {
  if (GetParam().label == std::string("glb_draco") || GetParam().label == std::string("glb_draco_lossless")) {
    GTEST_SKIP() << "Draco does not encode a mesh without faces";
  }
  TriangleMesh points = make_tetrahedron();
  points.triangles.clear();
  const Result<ImportedMesh> imported = import(GetParam().write(points));
  ASSERT_FALSE(imported);
  expect_good_error(imported.error());
}

TEST_P(EveryFormat, CoordinatesThatAreNotFiniteOrTooLargeAreErrors) {
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL, 2e30, -3e38}) {
    if (!GetParam().keeps_indices && GetParam().extension == std::string("glb")) break;  // Draco cannot encode them
    TriangleMesh mesh = make_tetrahedron();
    mesh.positions[2].y = bad;
    const Result<ImportedMesh> imported = import(GetParam().write(mesh));
    ASSERT_FALSE(imported) << bad;
    expect_good_error(imported.error());
    EXPECT_NE(imported.error().message.find("coordinate"), std::string::npos) << imported.error().message;
  }
}

TEST_P(EveryFormat, CoordinatesUpToTheLimitAreFine) {
  if (GetParam().label == std::string("glb_draco")) GTEST_SKIP() << "quantised";
  TriangleMesh mesh = make_tetrahedron();
  for (glm::dvec3& p : mesh.positions) p *= 0.99e30;
  mesh = in_float_precision(mesh);
  const Result<ImportedMesh> imported = import(GetParam().write(mesh));
  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_EQ(drawn_triangles(imported->mesh), drawn_triangles(mesh));
  EXPECT_TRUE(is_oriented_manifold(clean_mesh(imported->mesh).mesh));
}

TEST_P(EveryFormat, AnIndexOutOfRangeIsNamed) {
  if (!GetParam().keeps_indices) GTEST_SKIP() << "has no indices of its own";
  TriangleMesh mesh = make_tetrahedron();
  mesh.triangles[2][1] = 4;
  const Result<ImportedMesh> imported = import(GetParam().write(mesh));
  ASSERT_FALSE(imported);
  expect_good_error(imported.error());
  const std::string vertex = GetParam().format == MeshFormat::obj ? "vertex 5" : "vertex 4";
  EXPECT_NE(imported.error().message.find(vertex), std::string::npos) << imported.error().message;
}

TEST_P(EveryFormat, TheLimitsOfTheCallerHold) {
  const std::string bytes = GetParam().write(make_sphere(9, 14));
  const std::size_t triangles = make_sphere(9, 14).triangles.size();
  ImportOptions options;
  options.max_triangles = triangles;
  EXPECT_TRUE(import(bytes, options));
  options.max_triangles = triangles - 1;
  Result<ImportedMesh> imported = import(bytes, options);
  ASSERT_FALSE(imported);
  expect_good_error(imported.error());
  options = {};
  options.max_vertices = 50;
  imported = import(bytes, options);
  ASSERT_FALSE(imported);
  expect_good_error(imported.error());
}

// What a truncated text may still be taken for: one whose last number or line end is missing, which gets a warning; and
// OBJ, which has no counts, cut behind any line. STL's last line may lose the name behind endsolid.
TEST_P(EveryFormat, TruncationAtEveryByteIsAnErrorOrAWarning) {
  const TriangleMesh mesh = make_sphere(3, 4);
  const std::string bytes = GetParam().write(mesh);
  const std::string last_line_cut = bytes.substr(0, bytes.rfind('\n', bytes.size() - 2) + 1);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    SCOPED_TRACE("cut to " + std::to_string(size) + " of " + std::to_string(bytes.size()) + " bytes");
    const Result<ImportedMesh> imported = import(bytes.substr(0, size));
    if (!imported) {
      expect_good_error(imported.error());
      continue;
    }
    ASSERT_TRUE(GetParam().text) << "a binary file that is cut must be refused";
    if (GetParam().format == MeshFormat::obj) {
      EXPECT_EQ(imported->warnings.empty(), bytes[size - 1] == '\n');
    } else {
      EXPECT_GT(size, last_line_cut.size());
      EXPECT_TRUE(GetParam().format == MeshFormat::stl || !imported->warnings.empty());
    }
    EXPECT_LE(imported->mesh.triangles.size(), mesh.triangles.size());
  }
}

// Whatever the bytes are: an error or a mesh that cleans to a manifold.
TEST_P(EveryFormat, DamagedFilesNeverCrash) {
  const std::string bytes = GetParam().write(in_float_precision(make_sphere(4, 5)));
  std::size_t accepted = 0;
  constexpr unsigned kRounds = 1500;
  for (unsigned seed = 1; seed <= kRounds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    std::string damaged = bytes;
    const std::size_t changes = 1 + random() % 4;
    for (std::size_t i = 0; i < changes && !damaged.empty(); ++i) {
      const std::size_t at = random() % damaged.size();
      switch (random() % 5) {
        case 0: damaged[at] = static_cast<char>(random()); break;
        case 1: damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8)); break;
        case 2: damaged.erase(at, 1 + random() % 16); break;
        case 3: damaged.insert(at, damaged.substr(random() % damaged.size(), 1 + random() % 16)); break;
        default: damaged[at] = "0123456789-.eE+ \n/\"[]{}"[random() % 23]; break;
      }
    }
    const Result<ImportedMesh> imported = import(damaged);
    if (!imported) {
      expect_good_error(imported.error());
    } else {
      ++accepted;
      for (const Triangle& t : imported->mesh.triangles) {
        for (const VertexId v : t) ASSERT_LT(v, imported->mesh.positions.size());
      }
      std::string why;
      ASSERT_TRUE(is_oriented_manifold(clean_mesh(imported->mesh).mesh, &why)) << why;
    }
    if (HasFailure()) return;
  }
  EXPECT_GT(accepted, 0U);
  EXPECT_LT(accepted, kRounds);
}

INSTANTIATE_TEST_SUITE_P(Import, EveryFormat, ::testing::ValuesIn(all_formats()),
                         [](const ::testing::TestParamInfo<Format>& param) { return std::string(param.param.label); });

TEST(MeshImport, AMissingFileIsNotFound) {
  const Result<ImportedMesh> imported = import_mesh("/nowhere/at/all.ply");
  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.error().kind, ErrorKind::not_found);
  EXPECT_EQ(imported.error().message, "/nowhere/at/all.ply: cannot be opened: No such file or directory");
}

TEST(MeshImport, AnEmptyFileIsNamedAsSuch) {
  TemporaryFolder folder;
  for (const char* extension : {"ply", "stl", "obj", "off", "gltf", "glb", "xyz"}) {
    const Result<ImportedMesh> imported = import_mesh(folder.write(std::string("empty.") + extension, ""));
    ASSERT_FALSE(imported);
    EXPECT_TRUE(imported.error().message.ends_with("is empty")) << imported.error().message;
  }
}

TEST(MeshImport, FoldersAndPipesAreRefusedWithoutWaiting) {
  TemporaryFolder folder;
  EXPECT_EQ(import_mesh(folder.path()).error().kind, ErrorKind::io);
  const std::filesystem::path pipe = folder.path() / "pipe.ply";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(import_mesh(pipe).error().kind, ErrorKind::io);
  EXPECT_EQ(import_mesh("/dev/zero").error().kind, ErrorKind::io);
}

TEST(MeshImport, AnUnreadableFileIsAnIoError) {
  TemporaryFolder folder;
  const std::filesystem::path path = folder.write("locked.ply", ply_text(make_tetrahedron()));
  std::filesystem::permissions(path, std::filesystem::perms::none);
  if (std::ifstream(path).good()) GTEST_SKIP() << "this user may read everything";
  EXPECT_EQ(import_mesh(path).error().kind, ErrorKind::io);
}

TEST(MeshImport, AFormatThatNobodyKnowsIsUnsupported) {
  TemporaryFolder folder;
  const Result<ImportedMesh> imported = import_mesh(folder.write("notes.txt", "Dear diary\n"));
  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.error().kind, ErrorKind::unsupported);
}

TEST(MeshImport, TextInABinaryAndBinaryInATextAreErrors) {
  TemporaryFolder folder;
  const std::string prose(5000, 'x');
  const std::string noise = stl_binary(make_sphere(9, 14)).substr(100, 3001);
  for (const char* extension : {"ply", "stl", "obj", "off", "gltf", "glb"}) {
    for (const std::string& bytes : {prose, noise}) {
      const Result<ImportedMesh> imported = import_mesh(folder.write(std::string("wrong.") + extension, bytes));
      ASSERT_FALSE(imported) << extension;
      EXPECT_EQ(imported.error().kind, ErrorKind::bad_input) << imported.error().message;
    }
  }
  std::string ply = ply_binary(make_sphere(9, 14), false);
  const std::string header = ply.substr(0, ply.find("end_header") + 11);
  const Result<ImportedMesh> imported = import_mesh(folder.write("prose.ply", header + std::string(9000, 'x')));
  ASSERT_FALSE(imported);
  EXPECT_NE(imported.error().message.find(": byte "), std::string::npos) << imported.error().message;
}

TEST(MeshImport, WarnsWhenTheNameContradictsTheContent) {
  TemporaryFolder folder;
  const Result<ImportedMesh> imported = import_mesh(folder.write("cow.OBJ", ply_text(make_tetrahedron())));
  ASSERT_TRUE(imported) << imported.error().message;
  ASSERT_EQ(imported->warnings.size(), 1U);
  EXPECT_EQ(imported->warnings[0], "The file is called .OBJ, but its content is PLY.");
}

}  // namespace
}  // namespace fanstream
