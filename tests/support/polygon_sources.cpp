#include "tests/support/polygon_sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "tests/support/seeded_random.h"

namespace fanstream::testing {

std::vector<std::uint32_t> random_source_faces(const TriangleMesh& mesh, std::uint32_t most, std::uint64_t seed) {
  SeededRandom random(seed);
  std::map<std::pair<VertexId, VertexId>, std::uint32_t> at;  // directed edge to triangle
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) at[{mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]}] = t;
  }
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::vector<std::uint32_t> faces(mesh.triangles.size(), kNone);
  for (std::uint32_t t = 0; t < faces.size(); ++t) {
    if (faces[t] != kNone) continue;
    faces[t] = t;
    std::vector<std::uint32_t> members{t};
    for (std::uint32_t left = random.below(most); left > 0; --left) {
      const Triangle& from = mesh.triangles[members[random.below(members.size())]];
      const std::uint32_t k = random.below(3);
      const auto found = at.find({from[(k + 1) % 3], from[k]});
      if (found == at.end() || faces[found->second] != kNone) continue;
      faces[found->second] = t;
      members.push_back(found->second);
    }
  }
  return faces;
}

std::vector<std::uint32_t> paired_source_faces(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> faces(mesh.triangles.size());
  for (std::uint32_t t = 0; t < faces.size(); ++t) faces[t] = t / 2;
  return faces;
}

PlacedFace placed(std::span<const VertexId> face, const std::vector<glm::dvec3>& positions) {
  PlacedFace corners;
  for (const VertexId v : face) corners.push_back({positions[v].x, positions[v].y, positions[v].z});
  PlacedFace least = corners;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    least = std::min(least, corners);
  }
  return least;
}

std::vector<PlacedFace> placed_polygons(const JoinedFaces& faces, const std::vector<glm::dvec3>& positions) {
  std::vector<PlacedFace> all;
  for (std::uint32_t f = 0; f < faces.face_count(); ++f) {
    if (faces.face(f).size() > 3) all.push_back(placed(faces.face(f), positions));
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::vector<PlacedFace> source_polygons(const TriangleMesh& mesh, const std::vector<std::uint32_t>& source_faces) {
  std::vector<std::uint8_t> inner = inner_edges(mesh.triangles, source_faces);
  return placed_polygons(join_triangles(mesh.triangles, inner), mesh.positions);
}

std::string obj_text(const TriangleMesh& mesh, const std::vector<std::uint32_t>& source_faces) {
  std::vector<std::uint8_t> inner = inner_edges(mesh.triangles, source_faces);
  const JoinedFaces faces = join_triangles(mesh.triangles, inner);
  std::string text;
  for (const glm::dvec3& p : mesh.positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (std::uint32_t f = 0; f < faces.face_count(); ++f) {
    text += 'f';
    for (const VertexId v : faces.face(f)) text += fmt::format(" {}", v + 1);
    text += '\n';
  }
  return text;
}

}  // namespace fanstream::testing
