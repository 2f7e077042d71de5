#include "common/mesh/triangle_joining.h"

#include <algorithm>

namespace fanstream {
namespace {

using HalfEdge = std::uint32_t;  // 3 t + k
constexpr HalfEdge kNone = ~HalfEdge{0};

HalfEdge next_in_triangle(HalfEdge h) { return h % 3 == 2 ? h - 2 : h + 1; }

// The pairs of opposite half-edges among those for which wanted(h) holds, sorted by edge.
template <class Wanted, class Use>
void for_each_pair(std::span<const Triangle> triangles, Wanted&& wanted, Use&& use) {
  struct Side {
    VertexId low, high;
    HalfEdge half_edge;
  };
  std::vector<Side> sides;
  for (HalfEdge h = 0; h < 3 * triangles.size(); ++h) {
    if (!wanted(h)) continue;
    const VertexId a = triangles[h / 3][h % 3];
    const VertexId b = triangles[h / 3][next_in_triangle(h) % 3];
    sides.push_back({std::min(a, b), std::max(a, b), h});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    if (a.low != b.low) return a.low < b.low;
    return a.high != b.high ? a.high < b.high : a.half_edge < b.half_edge;
  });
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    if (sides[i].low != sides[i + 1].low || sides[i].high != sides[i + 1].high) continue;
    use(sides[i].half_edge, sides[i + 1].half_edge);
    ++i;
  }
}

class Joiner {
 public:
  Joiner(std::span<const Triangle> triangles, std::vector<std::uint8_t>& inner)
      : triangles_(triangles), inner_(inner), opposite_(3 * triangles.size(), kNone) {}

  JoinedFaces run() {
    for_each_pair(
        triangles_, [&](HalfEdge h) { return (inner_[h / 3] >> (h % 3) & 1U) != 0; },
        [&](HalfEdge a, HalfEdge b) {
          opposite_[a] = b;
          opposite_[b] = a;
        });
    faces_.face_of_triangle.assign(triangles_.size(), kNone);
    faces_.corners.reserve(3 * triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      if (faces_.face_of_triangle[t] == kNone) add_face_of(t);
    }
    set_bits();
    return std::move(faces_);
  }

 private:
  void add_face_of(std::uint32_t triangle) {
    collect(triangle);
    if (members_.size() > 1 && !walk_boundary()) {
      for (const std::uint32_t t : members_) {
        for (HalfEdge h = 3 * t; h < 3 * t + 3; ++h) opposite_[h] = kNone;
      }
      for (const std::uint32_t t : members_) faces_.face_of_triangle[t] = kNone;
      members_.assign(1, triangle);  // the others' turn comes
      faces_.face_of_triangle[triangle] = faces_.face_count();
    }
    if (members_.size() == 1) outline_.assign(triangles_[triangle].begin(), triangles_[triangle].end());
    std::rotate(outline_.begin(), std::min_element(outline_.begin(), outline_.end()), outline_.end());
    faces_.corners.insert(faces_.corners.end(), outline_.begin(), outline_.end());
    faces_.first.push_back(static_cast<std::uint32_t>(faces_.corners.size()));
  }

  void collect(std::uint32_t triangle) {
    members_.assign(1, triangle);
    faces_.face_of_triangle[triangle] = faces_.face_count();
    for (std::size_t i = 0; i < members_.size(); ++i) {
      for (HalfEdge h = 3 * members_[i]; h < 3 * members_[i] + 3; ++h) {
        if (opposite_[h] == kNone || faces_.face_of_triangle[opposite_[h] / 3] != kNone) continue;
        faces_.face_of_triangle[opposite_[h] / 3] = faces_.face_count();
        members_.push_back(opposite_[h] / 3);
      }
    }
  }

  // False unless the members are a disc whose corners all differ.
  bool walk_boundary() {
    if (members_.size() + 2 > kMostPolygonCorners) return false;
    std::size_t joined = 0;
    HalfEdge start = kNone;
    for (const std::uint32_t t : members_) {
      for (HalfEdge h = 3 * t; h < 3 * t + 3; ++h) {
        if (opposite_[h] != kNone) {
          ++joined;
        } else if (start == kNone) {
          start = h;
        }
      }
    }
    if (joined != 2 * (members_.size() - 1)) return false;
    outline_.clear();
    HalfEdge at = start;
    do {
      outline_.push_back(triangles_[at / 3][at % 3]);
      at = next_in_triangle(at);
      while (opposite_[at] != kNone) at = next_in_triangle(opposite_[at]);
    } while (at != start);
    sorted_ = outline_;
    std::sort(sorted_.begin(), sorted_.end());
    return std::adjacent_find(sorted_.begin(), sorted_.end()) == sorted_.end();
  }

  void set_bits() {
    for (std::size_t t = 0; t < inner_.size(); ++t) {
      inner_[t] = 0;
      for (HalfEdge k = 0; k < 3; ++k) {
        if (opposite_[3 * t + k] != kNone) inner_[t] = static_cast<std::uint8_t>(inner_[t] | 1U << k);
      }
    }
  }

  std::span<const Triangle> triangles_;
  std::vector<std::uint8_t>& inner_;
  std::vector<HalfEdge> opposite_;  // of those to be joined across
  JoinedFaces faces_;
  std::vector<std::uint32_t> members_;      // of the face at hand
  std::vector<VertexId> outline_, sorted_;  // of the face at hand
};

}  // namespace

JoinedFaces join_triangles(std::span<const Triangle> triangles, std::vector<std::uint8_t>& inner) {
  return Joiner(triangles, inner).run();
}

std::vector<std::uint8_t> inner_edges(std::span<const Triangle> triangles,
                                      std::span<const std::uint32_t> source_faces) {
  std::vector<std::uint8_t> inner(triangles.size(), 0);
  if (source_faces.empty()) return inner;
  // Only faces of several triangles have any.
  std::vector<std::uint8_t> several(triangles.size(), 0);
  for (std::size_t t = 1; t < triangles.size(); ++t) {
    if (source_faces[t] == source_faces[t - 1]) several[t] = several[t - 1] = 1;
  }
  for_each_pair(
      triangles, [&](HalfEdge h) { return several[h / 3] != 0; },
      [&](HalfEdge a, HalfEdge b) {
        if (source_faces[a / 3] != source_faces[b / 3]) return;
        inner[a / 3] = static_cast<std::uint8_t>(inner[a / 3] | 1U << (a % 3));
        inner[b / 3] = static_cast<std::uint8_t>(inner[b / 3] | 1U << (b % 3));
      });
  return inner;
}

}  // namespace fanstream
