#include "server/build/carried_surface.h"

#include <cmath>

#include "common/support/cache_lines.h"

namespace fanstream {

CarriedSurface::CarriedSurface(const PlacedMesh& mesh, std::uint32_t part) : lists_of_(mesh.faces.size()) {
  const std::uint32_t first = mesh.part_begin(part);
  const std::uint32_t count = mesh.part_begin(part + 1) - first;
  triangles_.resize(count);
  lists_.resize(count);
  listed_ = count;
  number_vertices(mesh, first);
  for (std::uint32_t t = 0; t < count; ++t) {
    CarriedTriangle& triangle = triangles_[t];
    triangle.faces[0] = first + t;
    const glm::dvec3 a(vertices_[triangle.corners[0]].place);
    const glm::dvec3 normal = glm::cross(glm::dvec3(vertices_[triangle.corners[1]].place) - a,
                                         glm::dvec3(vertices_[triangle.corners[2]].place) - a);
    const double length = glm::length(normal);
    if (length > 0.0) triangle.normal = glm::vec3(normal / length);
    lists_[t] = t;
    lists_of_[first + t] = {t, 1};
  }
}

// In the order in which the triangles come to them.
void CarriedSurface::number_vertices(const PlacedMesh& mesh, std::uint32_t first) {
  std::vector<VertexId> number(mesh.places.size(), kNone);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    for (int i = 0; i < 3; ++i) {
      const VertexId v = mesh.faces[first + t][static_cast<std::size_t>(i)];
      if (number[v] == kNone) {
        number[v] = static_cast<VertexId>(vertices_.size());
        vertices_.emplace_back().place = mesh.places[v];
      }
      triangles_[t].corners[i] = number[v];
    }
  }
  model_vertices_ = vertices_.size();
}

bool CarriedSurface::is_inside(const CarriedTriangle& triangle) const {
  for (int p = 0; p < triangle.piece_count(); ++p) {
    if (!is_covered(triangle.faces[p])) return false;
  }
  return true;
}

bool CarriedSurface::is_touched(const CarriedTriangle& triangle) const {
  for (int p = 0; p < triangle.piece_count(); ++p) {
    if (is_covered(triangle.faces[p])) return true;
  }
  return false;
}

void CarriedSurface::fetch(const GenerationStars& stars, std::size_t patch) const {
  constexpr std::size_t kLists = 4;
  constexpr std::size_t kTriangles = 2;
  if (patch + kLists < stars.patches.size()) {
    for (const std::uint32_t f : stars.covered_by(patch + kLists)) fetch_line(&lists_of_[f]);
  }
  if (patch + kTriangles < stars.patches.size()) {
    for (const std::uint32_t f : stars.covered_by(patch + kTriangles)) fetch_line(&lists_[lists_of_[f].begin]);
  }
}

bool CarriedSurface::gather(const GenerationStars& stars, std::size_t patch) {
  patch_ = stars.patches[patch].number;
  items_.clear();
  has_parts_ = false;
  const auto covered = stars.covered_by(patch);
  std::uint32_t listed = 0;
  for (const std::uint32_t f : covered) {
    List& list = lists_of_[f];
    list.covered_by = patch_;
    listed += list.size;
    for (std::uint32_t i = 0; i < list.size; ++i) fetch_line(&triangles_[lists_[list.begin + i]]);
  }
  if (listed == 0) return false;
  listed_ -= listed;
  star_.assign(stars, patch);
  for (const std::uint32_t f : covered) {
    List& list = lists_of_[f];
    for (std::uint32_t i = 0; i < list.size; ++i) gather_one(lists_[list.begin + i]);
    list.size = 0;
  }
  if (has_parts_) join_parts();
  return true;
}

// A face lists a triangle by its own number as long as one of its parts is there.
void CarriedSurface::gather_one(std::uint32_t t) {
  CarriedTriangle& triangle = triangles_[t];
  if (triangle.stamp == patch_) return;
  triangle.stamp = patch_;
  if (triangle.child_count != 0) {
    for (std::uint32_t i = 0; i < triangle.child_count; ++i) gather_one(triangle.children + i);
    return;
  }
  if (triangle.parent != kNone) {
    if (!is_touched(triangle)) return;
    has_parts_ = true;
  }
  items_.push_back(t);
  for (const VertexId v : triangle.corners) fetch_line(&vertices_[v]);
}

// Parts that have all come together in this patch are needed no longer. What they make up comes behind the other items.
void CarriedSurface::join_parts() {
  std::size_t kept = 0;
  const std::size_t count = items_.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t t = items_[i];
    const std::uint32_t parent = triangles_[t].parent;
    if (parent == kNone || !are_parts_inside(triangles_[parent])) {
      items_[kept++] = t;
    } else if (t == triangles_[parent].children) {
      items_.push_back(parent);
    }
  }
  items_.erase(items_.begin() + static_cast<std::ptrdiff_t>(kept), items_.begin() + static_cast<std::ptrdiff_t>(count));
  for (std::size_t i = kept; i < items_.size(); ++i) join(triangles_[items_[i]]);
}

bool CarriedSurface::are_parts_inside(const CarriedTriangle& whole) const {
  for (std::uint32_t i = 0; i < whole.child_count; ++i) {
    const CarriedTriangle& part = triangles_[whole.children + i];
    if (part.child_count != 0 || !is_inside(part)) return false;
  }
  return true;
}

void CarriedSurface::join(CarriedTriangle& whole) {
  whole.cut = Cut::whole;
  whole.faces[0] = triangles_[whole.children].faces[0];
  for (std::uint32_t i = 0; i < whole.child_count; ++i) {
    for (const VertexId v : triangles_[whole.children + i].corners) {
      const bool inherited = v < model_vertices_ || std::find(whole.corners, whole.corners + 3, v) != whole.corners + 3;
      if (inherited || vertices_[v].face == kNone) continue;
      vertices_[v].face = kNone;  // so that it is handed back once
      free_vertices_.push_back(v);
    }
  }
  free_triangles_[whole.child_count].push_back(whole.children);
  whole.children = kNone;
  whole.child_count = 0;
}

TriangleInStar CarriedSurface::in_star(const CarriedTriangle& triangle) const {
  TriangleInStar at;
  for (int i = 0; i < 3; ++i) at.points[i] = vertices_[triangle.corners[i]].place - star_.centre();
  at.all_inside = true;
  for (int p = 0; p < triangle.piece_count(); ++p) {
    at.inside[p] = is_covered(triangle.faces[p]);
    at.all_inside = at.all_inside && at.inside[p];
  }
  return at;
}

VertexId CarriedSurface::add_vertex(const glm::vec3& seen_from_centre) {
  auto v = static_cast<VertexId>(vertices_.size());
  if (free_vertices_.empty()) {
    vertices_.emplace_back();
  } else {
    v = free_vertices_.back();
    free_vertices_.pop_back();
    vertices_[v] = {};
  }
  vertices_[v].place = star_.centre() + seen_from_centre;
  return v;
}

std::uint32_t CarriedSurface::take_numbers(std::size_t count) {
  auto first = static_cast<std::uint32_t>(triangles_.size());
  if (free_triangles_[count].empty()) {
    triangles_.resize(triangles_.size() + count);
  } else {
    first = free_triangles_[count].back();
    free_triangles_[count].pop_back();
  }
  return first;
}

std::span<const std::uint32_t> CarriedSurface::cut(std::uint32_t t) {
  const TriangleInStar at = in_star(triangles_[t]);
  parts_.clear();
  inside_.clear();
  if (at.all_inside) {
    cut_whole(triangles_[t], at);
  } else {
    cut_pieces(triangles_[t], at);
  }
  const std::uint32_t first = take_numbers(parts_.size());
  CarriedTriangle& whole = triangles_[t];
  whole.children = first;
  whole.child_count = static_cast<std::uint8_t>(parts_.size());
  for (std::uint32_t i = 0; i < parts_.size(); ++i) {
    CarriedTriangle& part = triangles_[first + i];
    part = {};
    part.normal = whole.normal;
    part.parent = t;
    part.stamp = patch_;
    std::copy_n(parts_[i].corners, 3, part.corners);
    part.faces[0] = parts_[i].face;
    if (is_covered(part.faces[0])) inside_.push_back(first + i);
  }
  items_.insert(items_.end(), inside_.begin(), inside_.end());
  return inside_;
}

// Below the star's centre if that lies above the triangle; else where the plane through an edge of the star cuts it
// best; else into quarters.
void CarriedSurface::cut_whole(const CarriedTriangle& whole, const TriangleInStar& at) {
  const glm::vec2 above = centre_above(at.points);
  if (std::min({above.x, above.y, 1.0F - above.x - above.y}) > 0.05F) {
    cut_above_centre(whole, at, above);
  } else if (const EdgePlane plane = best_plane(at); plane.share > 0.05F) {
    cut_along(whole, at, plane.sides);
  } else {
    quarter(whole, at);
  }
}

void CarriedSurface::cut_above_centre(const CarriedTriangle& whole, const TriangleInStar& at, const glm::vec2& above) {
  const auto& p = at.points;
  const VertexId centre = add_vertex(p[0] + above.x * (p[1] - p[0]) + above.y * (p[2] - p[0]));
  for (int e = 0; e < 3; ++e) add_part(whole, centre, whole.corners[e], whole.corners[(e + 1) % 3]);
}

CarriedSurface::EdgePlane CarriedSurface::best_plane(const TriangleInStar& at) const {
  EdgePlane best;
  const StarDistance& star = star_.distance();
  const glm::vec3 middle = at.points[0] + at.points[1] + at.points[2];
  for (std::uint32_t f = 0; f < star.count(); ++f) {
    if (star.after(f) == StarDistance::kNoFace) continue;
    if (glm::dot(star_.edge_after(f), middle) <= 0.0F) continue;  // the plane's other half
    const glm::vec3 sides(star.side(at.points[0], f), star.side(at.points[1], f), star.side(at.points[2], f));
    const float most = std::max({sides.x, sides.y, sides.z});
    const float least = std::min({sides.x, sides.y, sides.z});
    const float share = std::min(most, -least) / (most - least);
    if (share > best.share) best = {sides, share};
  }
  return best;
}

void CarriedSurface::cut_along(const CarriedTriangle& whole, const TriangleInStar& at, const glm::vec3& sides) {
  const float nothing = 1e-3F * std::max({std::fabs(sides.x), std::fabs(sides.y), std::fabs(sides.z)});
  const auto crossing = [&](int from, int to) {
    return add_vertex(at.points[from] + sides[from] / (sides[from] - sides[to]) * (at.points[to] - at.points[from]));
  };
  for (int k = 0; k < 3; ++k) {
    if (std::fabs(sides[k]) > nothing) continue;
    const int i = (k + 1) % 3;
    const int j = (k + 2) % 3;
    const VertexId across = crossing(i, j);
    add_part(whole, whole.corners[k], whole.corners[i], across);
    add_part(whole, whole.corners[k], across, whole.corners[j]);
    return;
  }
  int k = 0;
  while ((sides[(k + 1) % 3] > 0.0F) != (sides[(k + 2) % 3] > 0.0F)) ++k;
  const int i = (k + 1) % 3;
  const int j = (k + 2) % 3;
  const VertexId to_i = crossing(k, i);
  const VertexId to_j = crossing(k, j);
  add_part(whole, whole.corners[k], to_i, to_j);
  add_part(whole, to_i, whole.corners[i], whole.corners[j]);
  add_part(whole, to_i, whole.corners[j], to_j);
}

void CarriedSurface::quarter(const CarriedTriangle& whole, const TriangleInStar& at) {
  VertexId middle[3];
  for (int e = 0; e < 3; ++e) middle[e] = add_vertex(0.5F * (at.points[e] + at.points[(e + 1) % 3]));
  for (int e = 0; e < 3; ++e) add_part(whole, whole.corners[e], middle[e], middle[(e + 2) % 3]);
  add_part(whole, middle[0], middle[1], middle[2]);
}

void CarriedSurface::add_part(const CarriedTriangle& whole, VertexId a, VertexId b, VertexId c) {
  parts_.push_back({{a, b, c}, whole.faces[0]});
}

// So that each part lies in one piece, since pieces elsewhere must stay.
void CarriedSurface::cut_pieces(const CarriedTriangle& whole, const TriangleInStar& at) {
  for (int p = 0; p < whole.piece_count(); ++p) {
    const Piece piece = piece_of(whole, at.points, p);
    VertexId corners[5];
    for (int i = 0; i < piece.count; ++i) corners[i] = vertex_at(whole, at, piece.points[i]);
    for (int i = 1; i + 1 < piece.count; ++i) {
      parts_.push_back({{corners[0], corners[i], corners[i + 1]}, whole.faces[p]});
    }
  }
}

VertexId CarriedSurface::vertex_at(const CarriedTriangle& whole, const TriangleInStar& at, const glm::vec3& point) {
  for (int c = 0; c < 3; ++c) {
    if (at.points[c] == point) return whole.corners[c];
  }
  const glm::vec3 place = star_.centre() + point;
  for (const Part& part : parts_) {
    for (const VertexId v : part.corners) {
      if (vertices_[v].place == place) return v;
    }
  }
  return add_vertex(point);
}

void CarriedSurface::rewrite_lists() {
  const auto for_each_entry = [&](auto&& entry) {
    for (const std::uint32_t t : items_) {
      const CarriedTriangle& triangle = triangles_[t];
      if (triangle.child_count != 0) continue;
      const auto& on = triangle.faces;
      const int count = triangle.piece_count();
      if (is_covered(on[0])) entry(t, on[0]);
      if (count > 1 && on[1] != on[0] && is_covered(on[1])) entry(t, on[1]);
      if (count > 2 && on[2] != on[0] && on[2] != on[1] && is_covered(on[2])) entry(t, on[2]);
    }
  };
  for_each_entry([&](std::uint32_t, std::uint32_t f) { ++lists_of_[f].size; });
  auto end = static_cast<std::uint32_t>(lists_.size());
  for (std::uint32_t i = 0; i < star_.count(); ++i) {
    List& list = lists_of_[star_.face(i)];
    list.begin = end;
    end += list.size;
    listed_ += list.size;
    list.size = 0;
  }
  lists_.resize(end);
  for_each_entry([&](std::uint32_t t, std::uint32_t f) { lists_[lists_of_[f].begin + lists_of_[f].size++] = t; });
  if (lists_.size() > 3 * listed_ + 4096) compact_lists();
}

void CarriedSurface::compact_lists() {
  std::vector<std::uint32_t> kept;
  kept.reserve(2 * listed_);
  for (List& list : lists_of_) {
    const auto begin = static_cast<std::uint32_t>(kept.size());
    kept.insert(kept.end(), lists_.begin() + list.begin, lists_.begin() + list.begin + list.size);
    list.begin = begin;
  }
  lists_ = std::move(kept);
}

}  // namespace fanstream
