#include "tests/support/polygon_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "tests/support/seeded_random.h"

namespace fanstream::testing {
namespace {

using Edge = std::pair<VertexId, VertexId>;

// Faces as lists of their own, and the face on the left of each directed edge.
struct FaceLists {
  std::vector<std::vector<VertexId>> faces;
  std::map<Edge, FaceId> face_of;
  std::vector<unsigned> edges_at;  // of each vertex

  explicit FaceLists(const PolygonMesh& mesh) : edges_at(mesh.points.size(), 0) {
    for (FaceId f = 0; f < mesh.face_count(); ++f) {
      faces.emplace_back(mesh.face(f).begin(), mesh.face(f).end());
      for_edges(f, [&](VertexId a, VertexId b) { face_of[{a, b}] = f; });
    }
    for (const auto& [edge, face] : face_of) {
      const bool counted = face_of.contains({edge.second, edge.first}) && edge.second < edge.first;
      if (counted) continue;
      ++edges_at[edge.first];
      ++edges_at[edge.second];
    }
  }

  template <class Visit>
  void for_edges(FaceId f, Visit visit) const {
    for (std::size_t i = 0; i < faces[f].size(); ++i) visit(faces[f][i], faces[f][(i + 1) % faces[f].size()]);
  }

  bool can_dissolve(VertexId a, VertexId b) const {
    const FaceId f = face_of.at({a, b});
    const auto other = face_of.find({b, a});
    if (other == face_of.end() || other->second == f) return false;
    for (const VertexId v : {a, b}) {
      if (edges_at[v] < (at_boundary(v) ? 3U : 4U)) return false;
    }
    // They may share these two vertices only.
    std::size_t shared = 0;
    for (const VertexId v : faces[f]) {
      shared += static_cast<std::size_t>(std::count(faces[other->second].begin(), faces[other->second].end(), v));
    }
    return shared == 2;
  }

  bool at_boundary(VertexId v) const {
    for (const auto& [edge, face] : face_of) {
      if ((edge.first == v || edge.second == v) && !face_of.contains({edge.second, edge.first})) return true;
    }
    return false;
  }

  void dissolve(VertexId a, VertexId b) {
    const FaceId f = face_of.at({a, b});
    const FaceId g = face_of.at({b, a});
    const auto from = [this](FaceId face, VertexId v) {
      std::vector<VertexId> list = faces[face];
      std::rotate(list.begin(), std::find(list.begin(), list.end(), v), list.end());
      return list;
    };
    std::vector<VertexId> united = from(f, b);      // b ... a
    const std::vector<VertexId> rest = from(g, a);  // a ... b
    united.insert(united.end(), rest.begin() + 1, rest.end() - 1);
    face_of.erase({a, b});
    face_of.erase({b, a});
    --edges_at[a];
    --edges_at[b];
    faces[f] = united;
    faces[g].clear();
    for_edges(f, [&](VertexId p, VertexId q) { face_of[{p, q}] = f; });
  }
};

}  // namespace

PolygonMesh make_cube() {
  PolygonMesh mesh;
  for (unsigned i = 0; i < 8; ++i) {
    mesh.points.emplace_back((i & 1U) != 0 ? 1 : -1, (i & 2U) != 0 ? 1 : -1, (i & 4U) != 0 ? 1 : -1, 1);
  }
  for (const std::array<VertexId, 4>& face :
       {std::array<VertexId, 4>{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    mesh.add_face(face);
  }
  return mesh;
}

PolygonMesh make_quad_torus(unsigned rings, unsigned sides) {
  PolygonMesh mesh;
  for (unsigned i = 0; i < rings; ++i) {
    for (unsigned j = 0; j < sides; ++j) {
      const double u = 2 * std::numbers::pi * i / rings;
      const double v = 2 * std::numbers::pi * j / sides;
      const double r = 1 + 0.35 * std::cos(v);
      mesh.points.emplace_back(r * std::cos(u), r * std::sin(u), 0.35 * std::sin(v), 1);
    }
  }
  const auto at = [&](unsigned i, unsigned j) { return (i % rings) * sides + j % sides; };
  for (unsigned i = 0; i < rings; ++i) {
    for (unsigned j = 0; j < sides; ++j) {
      mesh.add_face(std::array<VertexId, 4>{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

PolygonMesh make_quad_grid(unsigned columns, unsigned rows) {
  PolygonMesh mesh;
  for (unsigned y = 0; y <= rows; ++y) {
    for (unsigned x = 0; x <= columns; ++x) mesh.points.emplace_back(x, y, 0, 1);
  }
  for (unsigned y = 0; y < rows; ++y) {
    for (unsigned x = 0; x < columns; ++x) {
      const VertexId a = y * (columns + 1) + x;
      mesh.add_face(std::array<VertexId, 4>{a, a + 1, a + columns + 2, a + columns + 1});
    }
  }
  return mesh;
}

PolygonMesh dual_of(const TriangleMesh& closed) {
  PolygonMesh mesh;
  std::map<Edge, FaceId> face_of;
  std::map<VertexId, std::map<VertexId, FaceId>> around;  // by vertex and the corner behind it: the triangle
  for (FaceId f = 0; f < closed.triangles.size(); ++f) {
    const Triangle& t = closed.triangles[f];
    mesh.points.emplace_back((closed.positions[t[0]] + closed.positions[t[1]] + closed.positions[t[2]]) / 3.0, 1.0);
    for (int i = 0; i < 3; ++i) around[t[i]][t[(i + 1) % 3]] = f;
  }
  for (const auto& [v, faces] : around) {
    std::vector<VertexId> polygon;
    VertexId behind = faces.begin()->first;
    do {
      const FaceId f = faces.at(behind);
      polygon.push_back(f);
      for (const VertexId corner : closed.triangles[f]) {
        if (corner == v || corner == behind) continue;
        behind = corner;
        break;
      }
    } while (behind != faces.begin()->first);
    mesh.add_face(polygon);
  }
  return mesh;
}

PolygonMesh with_dissolved_edges(const PolygonMesh& mesh, double share, std::uint64_t seed) {
  SeededRandom random(seed);
  FaceLists lists(mesh);
  std::vector<Edge> edges;
  for (const auto& [edge, face] : lists.face_of) {
    if (edge.first < edge.second) edges.push_back(edge);
  }
  random.shuffle(edges);
  for (const auto& [a, b] : edges) {
    if (random.unit() < share && lists.face_of.contains({a, b}) && lists.can_dissolve(a, b)) lists.dissolve(a, b);
  }
  PolygonMesh result;
  result.points = mesh.points;
  for (const std::vector<VertexId>& face : lists.faces) {
    if (!face.empty()) result.add_face(face);
  }
  return result;
}

PolygonMesh jittered(PolygonMesh mesh, double amount, std::uint64_t seed) {
  SeededRandom random(seed);
  for (glm::dvec4& point : mesh.points) {
    for (int axis = 0; axis < 3; ++axis) point[axis] += amount * (2 * random.unit() - 1);
  }
  return mesh;
}

PolygonMesh with_random_weights(PolygonMesh mesh, std::uint64_t seed) {
  SeededRandom random(seed);
  for (glm::dvec4& point : mesh.points) point *= std::exp2(2 * random.unit() - 1);
  return mesh;
}

}  // namespace fanstream::testing
