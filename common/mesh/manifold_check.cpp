#include "common/mesh/manifold_check.h"

#include <vector>

namespace fanstream {
namespace {

using std::to_string;

std::string describe(std::size_t index, const Triangle& t) {
  return "triangle " + to_string(index) + " (" + to_string(t[0]) + ", " + to_string(t[1]) + ", " + to_string(t[2]) +
         ")";
}

bool refuse(std::string* why, std::string reason) {
  if (why != nullptr) *why = std::move(reason);
  return false;
}

bool corners_are_valid(const TriangleMesh& mesh, std::string* why) {
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    for (const VertexId v : t) {
      if (v < mesh.positions.size()) continue;
      return refuse(why, describe(i, t) + " names vertex " + to_string(v) + ", but there are only " +
                             to_string(mesh.positions.size()));
    }
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return refuse(why, describe(i, t) + " repeats a corner");
  }
  return true;
}

// What the face at a corner contributes to the ring of the corner's vertex: the directed edge from -> to.
struct RingEdge {
  VertexId from;
  VertexId to;
  std::uint32_t triangle;
};

// Scratch marks per vertex, valid while `stamp` is the vertex whose ring is being walked.
struct RingMark {
  VertexId stamp_out = ~VertexId{0};
  VertexId stamp_in = ~VertexId{0};
  std::uint32_t edge_out = 0;
};

// The ring edges of one vertex must form a single path or a single cycle.
bool ring_is_one_fan(VertexId v, const RingEdge* edges, std::size_t count, std::vector<RingMark>& marks,
                     const TriangleMesh& mesh, std::string* why) {
  for (std::size_t i = 0; i < count; ++i) {
    const RingEdge& edge = edges[i];
    RingMark& from = marks[edge.from];
    RingMark& to = marks[edge.to];
    if (from.stamp_out == v || to.stamp_in == v) {
      const VertexId end = from.stamp_out == v ? edge.from : edge.to;
      return refuse(why, describe(edge.triangle, mesh.triangles[edge.triangle]) +
                             ": another triangle runs along its edge " + to_string(v) + "-" + to_string(end) +
                             " in the same direction");
    }
    from.stamp_out = v;
    from.edge_out = static_cast<std::uint32_t>(i);
    to.stamp_in = v;
  }
  std::size_t start = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (marks[edges[i].from].stamp_in != v) {
      start = i;  // an open fan begins where no face comes before
      break;
    }
  }
  std::size_t walked = 1;
  VertexId at = edges[start].to;
  while (walked < count && at != edges[start].from && marks[at].stamp_out == v) {
    at = edges[marks[at].edge_out].to;
    ++walked;
  }
  if (walked == count) return true;
  return refuse(why, "the " + to_string(count) + " faces around vertex " + to_string(v) + " form more than one fan");
}

}  // namespace

bool is_oriented_manifold(const TriangleMesh& mesh, std::string* why) {
  if (!corners_are_valid(mesh, why)) return false;
  const std::size_t vertex_count = mesh.positions.size();
  std::vector<std::uint64_t> first(vertex_count + 1, 0);
  for (const Triangle& t : mesh.triangles) {
    for (const VertexId v : t) ++first[v + 1];
  }
  for (std::size_t v = 0; v < vertex_count; ++v) {
    if (first[v + 1] == 0) return refuse(why, "vertex " + to_string(v) + " is used by no triangle");
    first[v + 1] += first[v];
  }
  std::vector<RingEdge> ring_edges(3 * mesh.triangles.size());
  std::vector<std::uint64_t> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      ring_edges[next[t[k]]++] = {t[(k + 1) % 3], t[(k + 2) % 3], static_cast<std::uint32_t>(i)};
    }
  }
  std::vector<RingMark> marks(vertex_count);
  for (std::size_t v = 0; v < vertex_count; ++v) {
    if (!ring_is_one_fan(static_cast<VertexId>(v), ring_edges.data() + first[v], first[v + 1] - first[v], marks, mesh,
                         why)) {
      return false;
    }
  }
  return true;
}

}  // namespace fanstream
