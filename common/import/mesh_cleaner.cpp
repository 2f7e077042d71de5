#include "common/import/mesh_cleaner.h"

#include <bit>

#include "common/import/fan_splitting.h"

namespace fanstream {
namespace {

constexpr VertexId kNoVertex = ~VertexId{0};

std::uint64_t hash_of(const glm::dvec3& p) {
  std::uint64_t h = std::bit_cast<std::uint64_t>(p.x) * 0x9E3779B97F4A7C15U;
  h = (std::rotl(h, 29) ^ std::bit_cast<std::uint64_t>(p.y)) * 0xBF58476D1CE4E5B9U;
  h = (std::rotl(h, 31) ^ std::bit_cast<std::uint64_t>(p.z)) * 0x94D049BB133111EBU;
  return h ^ (h >> 32);
}

// Makes -0 into +0 and returns, for each vertex, the first one at the same position.
std::vector<VertexId> find_first_at_position(std::vector<glm::dvec3>& positions) {
  std::vector<VertexId> table(std::bit_ceil(2 * positions.size() + 1), kNoVertex);
  const std::size_t mask = table.size() - 1;
  std::vector<VertexId> first(positions.size());
  for (std::size_t v = 0; v < positions.size(); ++v) {
    glm::dvec3& p = positions[v];
    p += 0.0;
    std::size_t slot = hash_of(p) & mask;
    while (table[slot] != kNoVertex && positions[table[slot]] != p) slot = (slot + 1) & mask;
    if (table[slot] == kNoVertex) table[slot] = static_cast<VertexId>(v);
    first[v] = table[slot];
  }
  return first;
}

void weld(TriangleMesh& mesh, std::vector<std::uint32_t>& source_faces, RepairReport& report) {
  const std::vector<VertexId> first = find_first_at_position(mesh.positions);
  for (std::size_t v = 0; v < first.size(); ++v) report.welded_vertices += first[v] != v ? 1 : 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const Triangle welded{first[t[0]], first[t[1]], first[t[2]]};
    if (welded[0] == welded[1] || welded[1] == welded[2] || welded[2] == welded[0]) continue;
    if (!source_faces.empty()) source_faces[kept] = source_faces[i];
    mesh.triangles[kept++] = welded;
  }
  report.degenerate_triangles = mesh.triangles.size() - kept;
  mesh.triangles.resize(kept);
  if (!source_faces.empty()) source_faces.resize(kept);
}

// Keeps the order of the vertices that stay.
void drop_unreferenced_vertices(TriangleMesh& mesh) {
  std::vector<VertexId> new_id(mesh.positions.size(), kNoVertex);
  for (const Triangle& t : mesh.triangles) {
    for (const VertexId v : t) new_id[v] = 0;
  }
  VertexId kept = 0;
  for (std::size_t v = 0; v < new_id.size(); ++v) {
    if (new_id[v] == kNoVertex) continue;
    mesh.positions[kept] = mesh.positions[v];
    new_id[v] = kept++;
  }
  mesh.positions.resize(kept);
  for (Triangle& t : mesh.triangles) t = {new_id[t[0]], new_id[t[1]], new_id[t[2]]};
}

}  // namespace

std::vector<std::pair<std::string, std::uint64_t>> named_counts(const RepairReport& report) {
  return {{"welded_vertices", report.welded_vertices},
          {"unreferenced_vertices", report.unreferenced_vertices},
          {"degenerate_triangles", report.degenerate_triangles},
          {"duplicate_triangles", report.duplicate_triangles},
          {"flipped_triangles", report.flipped_triangles},
          {"split_edges", report.split_edges},
          {"split_vertices", report.split_vertices}};
}

CleanedMesh clean_mesh(TriangleMesh mesh, std::vector<std::uint32_t> source_faces) {
  CleanedMesh cleaned{std::move(mesh), {}, std::move(source_faces)};
  RepairReport& report = cleaned.report;
  const std::size_t vertices_before = cleaned.mesh.positions.size();
  weld(cleaned.mesh, cleaned.source_faces, report);
  drop_unreferenced_vertices(cleaned.mesh);
  report.unreferenced_vertices = vertices_before - report.welded_vertices - cleaned.mesh.positions.size();
  FacePairing pairing = pair_faces(cleaned.mesh, &cleaned.source_faces);
  report.duplicate_triangles = pairing.duplicate_triangles;
  report.flipped_triangles = pairing.flipped_triangles;
  const FanSplitCounts counts = split_fans(cleaned.mesh, pairing);
  report.split_edges = counts.split_edges;
  report.split_vertices = counts.split_vertices;
  return cleaned;
}

}  // namespace fanstream
