#include "client/reduce/edge_reducer.h"

#include <algorithm>
#include <limits>

namespace fanstream {
namespace {

// Where a surface is flat every merge costs nothing. This share of its planes' weight times the squared length makes
// short edges go first, so that flat parts thin out evenly.
constexpr double kLengthShare = 1.0e-6;

// Around a vertex with more faces than this, edges are judged anew when they come up, not at every merge beside them.
constexpr std::uint32_t kLargeStar = 32;

// A merge may cost this much more than when it was judged and still go first.
constexpr double kStaleShare = 1e-6;

}  // namespace

EdgeReducer::EdgeReducer(const TriangleMesh& mesh, const CornerAttributes& attributes, const ReductionOptions& options,
                         std::size_t exact_triangles)
    : options_(options),
      exact_triangles_(exact_triangles),
      positions_(mesh.positions),
      mesh_(mesh),
      wedges_(mesh.triangles, mesh.positions.size(), attributes),
      quadrics_(mesh.positions.size()),
      heap_(mesh_.half_edge_count()) {
  // Into the unit ball, so that no power of a coordinate leaves the range of numbers. Half first: no overflow.
  Bounds box = bounds_of(positions_);
  center_ = 0.5 * box.low + 0.5 * box.high;
  const glm::dvec3 half = 0.5 * box.high - 0.5 * box.low;
  const double size = std::max({half.x, half.y, half.z});
  scale_ = size > 1e-300 ? 0.5 / size : 0.0;
  scaled_.reserve(positions_.size());
  for (const glm::dvec3& p : positions_) scaled_.push_back(scaled(p));
  for (HalfEdge h = 0; h < mesh_.half_edge_count(); h += 3) add_face_planes(h, 1.0 + options_.past_share);
  judge_all();
}

// The planes of one face: its own at its three corners, and upright ones at its edges on boundaries and seams.
void EdgeReducer::add_face_planes(HalfEdge any, double share) {
  const HalfEdge first = any - any % 3;
  const std::array<VertexId, 3> corners{mesh_.origin(first), mesh_.origin(first + 1), mesh_.origin(first + 2)};
  const std::array<glm::dvec3, 3> p{scaled_[corners[0]], scaled_[corners[1]], scaled_[corners[2]]};
  glm::dvec3 normal = glm::cross(p[1] - p[0], p[2] - p[0]);
  const double length = glm::length(normal);
  if (!(length > 0.0)) return;
  normal /= length;
  const bool by_area = options_.weight == PlaneWeight::area;
  Quadric plane;
  plane.add_plane(normal, -glm::dot(normal, p[0]), by_area ? share * 0.5 * length : share);
  for (const VertexId v : corners) quadrics_[v].add(plane);
  for (std::size_t i = 0; i < 3; ++i) {
    if (!is_border(first + static_cast<HalfEdge>(i))) continue;
    const std::size_t j = (i + 1) % 3;
    const glm::dvec3 along = p[j] - p[i];
    const double along_length = glm::length(along);
    if (!(along_length > 0.0)) continue;
    const glm::dvec3 upright = glm::cross(along / along_length, normal);
    const double weight = share * options_.border_weight * (by_area ? along_length * along_length : 1.0);
    Quadric border;
    border.add_plane(upright, -glm::dot(upright, p[i]), weight);
    quadrics_[corners[i]].add(border);
    quadrics_[corners[j]].add(border);
  }
}

EdgeReducer::Candidate EdgeReducer::judge(HalfEdge h) const {
  const VertexId a = mesh_.origin(h);
  const VertexId b = mesh_.target(h);
  EdgeEnds ends = wedges_.ends(mesh_, h);
  if (mesh_.opposite(h) != kNoHalfEdge) {
    ends.first_removable = ends.first_removable && !mesh_.is_boundary(a);
    ends.second_removable = ends.second_removable && !mesh_.is_boundary(b);
  }
  if (!ends.first_removable && !ends.second_removable) return {};
  Quadric planes = quadrics_[a];
  planes.add(quadrics_[b]);
  const glm::dvec3 p = scaled_[a];
  const glm::dvec3 q = scaled_[b];
  Candidate candidate{0.0, 0.0, a, true};
  if (ends.first_removable && ends.second_removable) {
    const EdgePlace place = place_on_edge(planes, p, q);
    candidate.k = place.k;
    candidate.cost = place.cost;
  } else {
    candidate.k = ends.first_removable ? 1.0 : 0.0;
    candidate.kept = ends.first_removable ? b : a;
    candidate.cost = std::max(0.0, planes.at(ends.first_removable ? q : p));
  }
  const glm::dvec3 u = q - p;
  candidate.cost += kLengthShare * planes.trace() * glm::dot(u, u);
  if (!std::isfinite(candidate.cost)) candidate.cost = std::numeric_limits<float>::max();
  return candidate;
}

void EdgeReducer::judge_all() {
  heap_.reserve(mesh_.half_edge_count() / 2 + 1);
  for (HalfEdge h = 0; h < mesh_.half_edge_count(); ++h) {
    if (mesh_.edge_of(h) != h) continue;
    const Candidate candidate = judge(h);
    if (candidate.allowed) {
      heap_.append(h, static_cast<float>(candidate.cost));
    } else {
      heap_.remove(h, kBorder);
    }
  }
  heap_.order_all();
}

void EdgeReducer::become_exact() {
  exact_ = true;
  for (HalfEdge h = 0; h < mesh_.half_edge_count(); ++h) {
    if (mesh_.is_live(h) && mesh_.edge_of(h) == h) file(h);
  }
}

void EdgeReducer::file(HalfEdge h) {
  const HalfEdge edge = mesh_.edge_of(h);
  const Candidate candidate = judge(edge);
  if (candidate.allowed) {
    heap_.put(edge, static_cast<float>(candidate.cost));
  } else {
    heap_.remove(edge, kBorder);
  }
}

// Whether a face around `moved` that does not vanish with the edge would turn over, or lose its area.
bool EdgeReducer::folds(HalfEdge h, VertexId moved, const glm::dvec3& place) const {
  const glm::dvec3 from = scaled_[moved];
  const glm::dvec3 to = scaled(place);
  const VertexId a = mesh_.origin(h);
  const VertexId b = mesh_.target(h);
  bool folded = false;
  mesh_.for_each_outgoing(moved, [&](HalfEdge g) {
    if (folded) return;
    const VertexId s = mesh_.target(g);
    const VertexId t = mesh_.apex(g);
    if (s == a || s == b || t == a || t == b) return;
    const glm::dvec3 ps = scaled_[s];
    const glm::dvec3 edge = scaled_[t] - ps;
    const glm::dvec3 before = glm::cross(edge, from - ps);
    const glm::dvec3 after = glm::cross(edge, to - ps);
    const double before_squared = glm::dot(before, before);
    if (before_squared == 0.0) return;  // it has no side to turn from
    const double cosine = glm::dot(before, after);
    const double least = options_.least_normal_cosine;
    folded = !(cosine > 0.0 && cosine * cosine > least * least * before_squared * glm::dot(after, after));
  });
  return folded;
}

std::uint32_t EdgeReducer::obstacle(HalfEdge h, const glm::dvec3& place) {
  const VertexId a = mesh_.origin(h);
  const VertexId b = mesh_.target(h);
  const std::uint32_t before = std::max(mesh_.faces_around(a), mesh_.faces_around(b));
  if (mesh_.faces_after(h) > std::max(options_.longest_ring, before)) return kRing;
  if (!mesh_.can_collapse(h)) return kTopology;
  if ((place != positions_[a] && folds(h, a, place)) || (place != positions_[b] && folds(h, b, place))) return kFold;
  return EdgeHeap::kAbsent;
}

bool EdgeReducer::reduce_to(std::size_t triangles) {
  while (mesh_.triangle_count() > triangles) {
    if (!exact_ && (mesh_.triangle_count() <= exact_triangles_ || heap_.empty())) become_exact();
    if (heap_.empty()) return false;
    const HalfEdge h = heap_.top();
    const Candidate candidate = judge(h);
    if (!candidate.allowed) {
      heap_.remove(h, kBorder);
      continue;
    }
    const auto cost = static_cast<float>(candidate.cost);
    if (candidate.cost > (1.0 + kStaleShare) * static_cast<double>(heap_.top_cost()) && cost > heap_.next_cost(cost)) {
      heap_.put(h, cost);
      continue;
    }
    const glm::dvec3 place = on_edge(positions_[mesh_.origin(h)], positions_[mesh_.target(h)], candidate.k);
    if (const std::uint32_t why = obstacle(h, place); why != EdgeHeap::kAbsent) {
      heap_.remove(h, why);
      continue;
    }
    merge(h, candidate, place);
  }
  return true;
}

// Takes the planes of all faces around the edge's ends from the quadrics of their corners.
void EdgeReducer::take_star_away(HalfEdge h) {
  const VertexId a = mesh_.origin(h);
  mesh_.for_each_outgoing(a, [&](HalfEdge g) { add_face_planes(g, -1.0); });
  const HalfEdge o = mesh_.opposite(h);
  mesh_.for_each_outgoing(mesh_.target(h), [&](HalfEdge g) {
    if (g / 3 == h / 3 || (o != kNoHalfEdge && g / 3 == o / 3)) return;
    add_face_planes(g, -1.0);
  });
}

void EdgeReducer::merge(HalfEdge h, const Candidate& candidate, const glm::dvec3& place) {
  const VertexId kept = candidate.kept;
  const VertexId removed = mesh_.other_end(h, kept);
  const HalfEdge o = mesh_.opposite(h);
  const std::array<VertexId, 2> apexes{mesh_.apex(h), o == kNoHalfEdge ? mesh_.apex(h) : mesh_.apex(o)};
  take_star_away(h);
  for (const HalfEdge gone : {h, o}) {
    if (gone == kNoHalfEdge) continue;
    for (const HalfEdge g : {gone, next_of(gone), previous_of(gone)}) heap_.remove(mesh_.edge_of(g));
  }
  wedges_.collapse(mesh_, h, kept, candidate.k);
  mesh_.collapse(h, kept);
  wedges_.settle(mesh_, kept);
  for (const VertexId apex : apexes) wedges_.settle(mesh_, apex);
  positions_[kept] = place;
  scaled_[kept] = scaled(place);
  // Without their faces, both ends have nothing but their past left.
  quadrics_[kept].add(quadrics_[removed]);
  mesh_.for_each_outgoing(kept, [&](HalfEdge g) { add_face_planes(g, 1.0); });
  judge_around(kept);
}

void EdgeReducer::judge_around(VertexId vertex) {
  mesh_.for_each_edge(vertex, [&](HalfEdge h) { file(h); });
  mesh_.begin_marks();
  mesh_.mark(vertex);
  mesh_.for_each_edge(vertex, [&](HalfEdge h) {
    const VertexId beside = mesh_.other_end(h, vertex);
    mesh_.mark(beside);
    if (mesh_.faces_around(beside) > kLargeStar) return;
    mesh_.for_each_edge(beside, [&](HalfEdge g) {
      // Its planes have changed, and what has kept it from being merged may be gone.
      if (!mesh_.is_marked(mesh_.other_end(g, beside)) && (exact_ || !heap_.holds(mesh_.edge_of(g)))) file(g);
    });
  });
}

std::string EdgeReducer::shortfall() const {
  std::array<std::size_t, 4> counts{};
  std::size_t edges = 0;
  for (HalfEdge h = 0; h < mesh_.half_edge_count(); ++h) {
    if (!mesh_.is_live(h) || mesh_.edge_of(h) != h) continue;
    ++edges;
    const std::uint32_t state = heap_.state(h);
    if (state >= kBorder && state <= kRing) ++counts[state - kBorder];
  }
  constexpr std::array<const char*, 4> kReasons{"would take a vertex off a boundary or a seam",
                                                "would change the topology", "would turn a face over",
                                                "would gather too many faces around a vertex"};
  std::string text = "none of the " + std::to_string(edges) + " edges left may be merged:";
  const char* separator = " ";
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    text += separator + std::to_string(counts[i]) + " " + kReasons[i];
    separator = ", ";
  }
  return text;
}

void EdgeReducer::extract(TriangleMesh& mesh, CornerAttributes& attributes) const {
  constexpr VertexId kUnused = 0xFFFFFFFFU;
  const VertexAttributes& values = wedges_.values();
  std::vector<VertexId> vertex_id(positions_.size(), kUnused);
  std::vector<VertexId> wedge_id(std::max(values.texture_coordinates.size(), values.colors.size()), kUnused);
  mesh.triangles.reserve(mesh_.triangle_count());
  for (HalfEdge h = 0; h < mesh_.half_edge_count(); h += 3) {
    if (!mesh_.is_live(h)) continue;
    mesh.triangles.push_back({mesh_.origin(h), mesh_.origin(h + 1), mesh_.origin(h + 2)});
    if (!wedges_.empty()) attributes.wedges.push_back(wedges_.wedges(h / 3));
    for (const VertexId v : mesh.triangles.back()) vertex_id[v] = 0;
    for (std::size_t i = 0; i < 3 && !wedges_.empty(); ++i) wedge_id[attributes.wedges.back()[i]] = 0;
  }
  VertexId vertices = 0;
  for (std::size_t v = 0; v < vertex_id.size(); ++v) {
    if (vertex_id[v] == kUnused) continue;
    vertex_id[v] = vertices++;
    mesh.positions.push_back(positions_[v]);
  }
  VertexId wedges = 0;
  for (std::size_t w = 0; w < wedge_id.size(); ++w) {
    if (wedge_id[w] == kUnused) continue;
    wedge_id[w] = wedges++;
    if (!values.texture_coordinates.empty()) {
      attributes.values.texture_coordinates.push_back(values.texture_coordinates[w]);
    }
    if (!values.colors.empty()) attributes.values.colors.push_back(values.colors[w]);
  }
  for (Triangle& t : mesh.triangles) t = {vertex_id[t[0]], vertex_id[t[1]], vertex_id[t[2]]};
  for (Triangle& t : attributes.wedges) t = {wedge_id[t[0]], wedge_id[t[1]], wedge_id[t[2]]};
}

}  // namespace fanstream
