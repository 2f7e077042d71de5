#include "common/fans/fan_cover.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/fans/cover_search.h"
#include "common/fans/paper_cover.h"

namespace fanstream {
namespace {

// More sweeps find ever less: on real meshes 4 leave 2.76 to 2.81 issued vertices per vertex, 16 leave 0.02 fewer.
constexpr int kSweeps = 4;
// In small meshes, where a fan more or less counts, the search for centres comes near the fewest possible in so many
// steps a vertex, and what it finds takes some sweeps to share out; in larger ones that would take too long.
constexpr std::size_t kMostSearchedVertices = 4096;
CenterSearchEffort search_effort(std::size_t vertices) {
  constexpr std::size_t kStepsPerVertex = 64;
  constexpr std::size_t kMostSteps = 49'152;
  constexpr std::size_t kMostStepsOfAllTries = 65'536;
  constexpr std::size_t kMostSweptVertices = 32'768;  // all sweeps of a try together
  constexpr std::size_t kMostSweeps = 48;
  constexpr std::size_t kMostTries = 4;
  const std::size_t count = std::max<std::size_t>(vertices, 1);
  const std::size_t steps = std::min(kMostSteps, kStepsPerVertex * count);
  return {steps, static_cast<int>(std::min(kMostSweeps, kMostSweptVertices / count)),
          static_cast<int>(std::min(kMostTries, kMostStepsOfAllTries / steps))};
}

FaceOwners owners_by(CoverMethod method, const VertexStars& stars) {
  if (method == CoverMethod::paper) return paper_owners(stars);
  FaceOwners owners = greedy_owners(stars);
  if (method == CoverMethod::greedy) return owners;
  improve_owners(stars, kSweeps, owners);
  const std::size_t vertices = stars.vertex_count();
  if (vertices <= kMostSearchedVertices) search_centers(stars, search_effort(vertices), owners);
  return owners;
}

// The same triangle starting at its smallest vertex.
Triangle rotated(Triangle triangle) {
  std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
  return triangle;
}

Result<void> append_triangles(std::size_t index, const FanMesh& mesh, std::vector<Triangle>& out) {
  const Fan& fan = mesh.fans[index];
  if (fan.first > mesh.rings.size() || fan.count > mesh.rings.size() - fan.first || fan.count < 2) {
    return fail(ErrorKind::bad_input, fmt::format("fan {}: {} ring vertices at {} of {} are none", index, fan.count,
                                                  fan.first, mesh.rings.size()));
  }
  const std::span<const VertexId> ring = mesh.ring(fan);
  if (!fan.closed && ring.front() == ring.back()) {
    return fail(ErrorKind::bad_input, fmt::format("fan {} goes all the way around but is not marked closed", index));
  }
  for (std::size_t i = 0; i < fan.face_count(); ++i) {
    out.push_back(rotated({fan.center, ring[i], ring[(i + 1) % ring.size()]}));
  }
  return {};
}

}  // namespace

Result<FanMesh> cover_with_fans(std::size_t vertex_count, std::span<const Triangle> triangles, CoverMethod method) {
  const auto stars = VertexStars::build(vertex_count, triangles);
  if (!stars) return tl::unexpected(stars.error());
  return fans_of(*stars, owners_by(method, *stars));
}

double FanStatistics::issued_per_vertex() const {
  return vertices == 0 ? 0.0 : static_cast<double>(issued_vertices) / static_cast<double>(vertices);
}

FanStatistics fan_statistics(std::size_t vertex_count, const FanMesh& mesh) {
  FanStatistics statistics;
  statistics.vertices = vertex_count;
  statistics.fans = mesh.fans.size();
  for (const Fan& fan : mesh.fans) {
    statistics.faces += fan.face_count();
    statistics.closed_fans += fan.closed ? 1 : 0;
    statistics.isolated_triangles += fan.face_count() == 1 ? 1 : 0;
  }
  statistics.issued_vertices = statistics.faces + 2 * statistics.fans;
  return statistics;
}

Result<void> check_cover(std::span<const Triangle> triangles, const FanMesh& mesh) {
  std::vector<Triangle> covered;
  covered.reserve(triangles.size());
  for (std::size_t i = 0; i < mesh.fans.size(); ++i) {
    if (auto appended = append_triangles(i, mesh, covered); !appended) return appended;
    if (covered.size() > triangles.size()) {
      return fail(ErrorKind::bad_input, fmt::format("fan {}: more faces than the mesh's {}", i, triangles.size()));
    }
  }
  std::vector<Triangle> wanted;
  wanted.reserve(triangles.size());
  for (const Triangle& triangle : triangles) wanted.push_back(rotated(triangle));
  std::sort(covered.begin(), covered.end());
  std::sort(wanted.begin(), wanted.end());
  const auto [missing, extra] = std::mismatch(wanted.begin(), wanted.end(), covered.begin(), covered.end());
  if (missing == wanted.end() && extra == covered.end()) return {};
  const bool is_missing = extra == covered.end() || (missing != wanted.end() && *missing < *extra);
  const Triangle& triangle = is_missing ? *missing : *extra;
  return fail(ErrorKind::bad_input,
              fmt::format("triangle ({}, {}, {}) is {}", triangle[0], triangle[1], triangle[2],
                          is_missing ? "in no fan" : "in a fan but not in the mesh, or in two fans"));
}

}  // namespace fanstream
