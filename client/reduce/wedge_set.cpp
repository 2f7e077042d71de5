#include "client/reduce/wedge_set.h"

#include <algorithm>

#include "client/reduce/edge_quadric.h"

namespace fanstream {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

}  // namespace

WedgeSet::WedgeSet(const std::vector<Triangle>& triangles, std::size_t vertex_count,
                   const CornerAttributes& attributes) {
  if (attributes.empty()) return;
  first_.assign(vertex_count, kNone);
  wedge_count_.assign(vertex_count, 0);
  wedge_of_.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      wedge_of_.push_back(wedge_for(triangles[t][i], attributes.wedges[t][i], attributes.values));
    }
  }
  first_ = {};
  next_ = {};
}

bool WedgeSet::equal(std::uint32_t wedge, std::uint32_t source, const VertexAttributes& from) const {
  if (!from.texture_coordinates.empty() && values_.texture_coordinates[wedge] != from.texture_coordinates[source]) {
    return false;
  }
  return from.colors.empty() || values_.colors[wedge] == from.colors[source];
}

std::uint32_t WedgeSet::wedge_for(VertexId vertex, std::uint32_t source, const VertexAttributes& from) {
  for (std::uint32_t wedge = first_[vertex]; wedge != kNone; wedge = next_[wedge]) {
    if (equal(wedge, source, from)) return wedge;
  }
  const auto wedge = static_cast<std::uint32_t>(next_.size());
  next_.push_back(first_[vertex]);
  first_[vertex] = wedge;
  ++wedge_count_[vertex];
  if (!from.texture_coordinates.empty()) values_.texture_coordinates.push_back(from.texture_coordinates[source]);
  if (!from.colors.empty()) values_.colors.push_back(from.colors[source]);
  return wedge;
}

bool WedgeSet::is_seam(const CollapseMesh& mesh, HalfEdge h) const {
  const HalfEdge o = mesh.opposite(h);
  if (empty() || o == kNoHalfEdge) return false;
  return wedge_of_[h] != wedge_of_[next_of(o)] || wedge_of_[next_of(h)] != wedge_of_[o];
}

WedgeSet::Sides WedgeSet::sides(const CollapseMesh& mesh, HalfEdge h) const {
  Sides sides;
  sides.wedges[sides.count++] = {wedge_of_[h], wedge_of_[next_of(h)]};
  const HalfEdge o = mesh.opposite(h);
  if (o != kNoHalfEdge) {
    const std::array<std::uint32_t, 2> other{wedge_of_[next_of(o)], wedge_of_[o]};
    if (other != sides.wedges[0]) sides.wedges[sides.count++] = other;
  }
  return sides;
}

bool WedgeSet::removable(VertexId v, const Sides& sides, std::size_t end) const {
  if (sides.count == 1) return wedge_count_[v] == 1;
  return sides.wedges[0][end] != sides.wedges[1][end] && wedge_count_[v] == 2;
}

EdgeEnds WedgeSet::ends(const CollapseMesh& mesh, HalfEdge h) const {
  if (empty()) return {true, true};
  const Sides both = sides(mesh, h);
  return {removable(mesh.origin(h), both, 0), removable(mesh.target(h), both, 1)};
}

void WedgeSet::collapse(const CollapseMesh& mesh, HalfEdge h, VertexId kept, double k) {
  if (empty()) return;
  const Sides both = sides(mesh, h);
  const std::size_t stays = mesh.origin(h) == kept ? 0 : 1;
  for (std::size_t s = 0; s < both.count; ++s) {
    const auto [a, b] = both.wedges[s];
    const std::uint32_t wedge = both.wedges[s][stays];
    if (!values_.texture_coordinates.empty()) {
      auto& uv = values_.texture_coordinates;
      uv[wedge] = on_edge(uv[a], uv[b], k);
    }
    if (!values_.colors.empty()) values_.colors[wedge] = on_edge(values_.colors[a], values_.colors[b], k);
  }
  mesh.for_each_outgoing(mesh.other_end(h, kept), [&](HalfEdge corner) {
    for (std::size_t s = 0; s < both.count; ++s) {
      if (wedge_of_[corner] != both.wedges[s][1 - stays]) continue;
      wedge_of_[corner] = both.wedges[s][stays];
      break;
    }
  });
}

void WedgeSet::settle(const CollapseMesh& mesh, VertexId vertex) {
  if (empty() || wedge_count_[vertex] == 1) return;
  std::vector<std::uint32_t> found;
  mesh.for_each_outgoing(vertex, [&](HalfEdge corner) { found.push_back(wedge_of_[corner]); });
  std::sort(found.begin(), found.end());
  wedge_count_[vertex] = static_cast<std::uint32_t>(std::unique(found.begin(), found.end()) - found.begin());
}

}  // namespace fanstream
