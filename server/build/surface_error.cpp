#include "server/build/surface_error.h"

#include <algorithm>
#include <cmath>

#include "server/build/carried_triangle.h"
#include "server/build/prefetch.h"

namespace fanstream {
namespace {

class SurfaceTracker {
 public:
  SurfaceTracker(const std::vector<Triangle>& triangles, std::vector<GridPoint> places, const PositionGrid& grid,
                 const CodedHistory& coded)
      : coded_(coded), grid_(grid), codes_(std::move(places)) {
    place_vertices();
    place_triangles(triangles);
  }

  SurfaceErrors run() {
    result_.patch_of.resize(coded_.history.merges.size());
    const MergeHistory& history = coded_.history;
    for (std::uint32_t k = 0; k < history.generation_count(); ++k) {
      gather_patches(k);
      for (std::size_t p = 0; p < roots_.size(); ++p) measure_patch(p);
      if (lists_.size() > 2 * listed_ + 1024) compact_lists();
    }
    return std::move(result_);
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  struct alignas(32) Vertex {
    glm::vec3 place{0.0F};        // in the full model
    float squared = 0.0F;         // from the nearest face of the star at hand
    std::uint32_t face = 0;       // which that is
    std::uint32_t stamp = kNone;  // the patch for which this was found
  };
  struct Face {
    std::uint32_t corners[3];
    std::uint32_t list = 0;  // what it carries: a range of lists_
    std::uint32_t list_size = 0;
    std::uint32_t stamp = kNone;  // the last patch that covered it
    std::uint32_t local = 0;      // its number in the star at hand
  };
  struct Range {
    std::uint32_t begin = 0;
    std::uint32_t size = 0;
  };

  // Grid values are whole numbers below 2^20, exact in floats as their differences are.
  glm::vec3 value_of(const GridPoint& code) const {
    const glm::dvec3 steps = (grid_.decode(code) - origin_) / grid_.step();
    return {std::round(steps.x), std::round(steps.y), std::round(steps.z)};
  }

  void place_vertices() {
    origin_ = grid_.decode(GridPoint(0));
    vertices_.resize(codes_.size());
    places_.resize(codes_.size());
    for (std::size_t v = 0; v < codes_.size(); ++v) {
      places_[v] = value_of(codes_[v]);
      vertices_[v].place = places_[v];
    }
    around_.resize(codes_.size());
    member_.assign(codes_.size(), kNone);
    patch_of_root_.assign(codes_.size(), kNone);
  }

  void place_triangles(const std::vector<Triangle>& triangles) {
    carried_.resize(triangles.size());
    faces_.resize(triangles.size());
    lists_.resize(triangles.size());
    listed_ = triangles.size();
    for (std::uint32_t f = 0; f < triangles.size(); ++f) {
      const Triangle& t = triangles[f];
      CarriedTriangle& carried = carried_[f];
      for (int i = 0; i < 3; ++i) {
        carried.corners[i] = t[i];
        carried.faces[i] = f;
        faces_[f].corners[i] = t[i];
        ++around_[t[i]].size;
      }
      const glm::dvec3 a(places_[t[0]]);
      const glm::dvec3 normal = glm::cross(glm::dvec3(places_[t[1]]) - a, glm::dvec3(places_[t[2]]) - a);
      const double length = glm::length(normal);
      carried.normal = length > 0.0 ? glm::vec3(normal / length) : glm::vec3(0.0F);
      faces_[f].list = f;
      faces_[f].list_size = 1;
      lists_[f] = f;
    }
    std::uint32_t begin = 0;
    for (Range& range : around_) {
      range.begin = begin;
      begin += range.size;
      range.size = 0;
    }
    around_pool_.resize(begin);
    for (std::uint32_t f = 0; f < triangles.size(); ++f) {
      for (const VertexId v : triangles[f]) around_pool_[around_[v].begin + around_[v].size++] = f;
    }
  }

  // The roots of a generation, the vertices each absorbs, and the roots' places afterwards.
  void gather_patches(std::uint32_t k) {
    const MergeHistory& history = coded_.history;
    roots_.clear();
    const std::uint32_t begin = history.generation_begin[k];
    const std::uint32_t end = history.generation_begin[k + 1];
    first_patch_ = static_cast<std::uint32_t>(result_.patches.size());
    for (std::uint32_t m = begin; m < end; ++m) {
      const MergeRecord& merge = history.merges[m];
      std::uint32_t& patch = patch_of_root_[merge.root];
      if (patch == kNone || patch < first_patch_) {
        patch = first_patch_ + static_cast<std::uint32_t>(roots_.size());
        roots_.push_back(merge.root);
      }
      result_.patch_of[m] = patch;
      codes_[merge.root] =
          place_after_merge(codes_[merge.root], codes_[merge.removed], merge.parent, history.generation_count() - k);
    }
    result_.patches.resize(first_patch_ + roots_.size());
    // Absorbed vertices by patch.
    absorbed_begin_.assign(roots_.size() + 1, 0);
    for (std::uint32_t m = begin; m < end; ++m) ++absorbed_begin_[result_.patch_of[m] - first_patch_ + 1];
    for (std::size_t p = 0; p < roots_.size(); ++p) absorbed_begin_[p + 1] += absorbed_begin_[p];
    absorbed_.resize(end - begin);
    for (std::uint32_t m = end; m-- > begin;) {
      absorbed_[--absorbed_begin_[result_.patch_of[m] - first_patch_ + 1]] = history.merges[m].removed;
    }
    // Every count above has become the beginning of the patch before it.
    for (std::size_t p = 0; p < roots_.size(); ++p) absorbed_begin_[p] = absorbed_begin_[p + 1];
    absorbed_begin_[roots_.size()] = end - begin;
    for (const VertexId root : roots_) places_[root] = value_of(codes_[root]);
  }

  void measure_patch(std::size_t p) {
    patch_ = first_patch_ + static_cast<std::uint32_t>(p);
    root_ = roots_[p];
    cover(std::span(absorbed_).subspan(absorbed_begin_[p], absorbed_begin_[p + 1] - absorbed_begin_[p]));
    gather_carried();
    make_star();
    find_nearest();
    for (const std::uint32_t t : items_) carry(carried_[t]);
    const float error = carrier_.error() + StarDistance::kMargin * extent_;
    result_.patches[patch_].error =
        std::nextafter(static_cast<float>(error * grid_.step()), std::numeric_limits<float>::infinity());
    result_.patches[patch_].normals = cone();
    rewrite_lists();
  }

  // The faces around the root and all that it absorbs. Those with one corner among them remain, with the root in its
  // place.
  void cover(std::span<const VertexId> absorbed) {
    covered_.clear();
    member_[root_] = patch_;
    for (const VertexId v : absorbed) member_[v] = patch_;
    const auto add_around = [&](VertexId v) {
      for (std::uint32_t i = 0; i < around_[v].size; ++i) {
        const std::uint32_t f = around_pool_[around_[v].begin + i];
        if (faces_[f].corners[0] == kNone || faces_[f].stamp == patch_) continue;
        faces_[f].stamp = patch_;
        covered_.push_back(f);
      }
    };
    add_around(root_);
    for (const VertexId v : absorbed) add_around(v);
  }

  // Each triangle with a corner on a covered face, once.
  void gather_carried() {
    items_.clear();
    for (const std::uint32_t f : covered_) {
      const Face& face = faces_[f];
      for (std::uint32_t i = 0; i < face.list_size; ++i) prefetch(&carried_[lists_[face.list + i]]);
    }
    for (const std::uint32_t f : covered_) {
      const Face& face = faces_[f];
      listed_ -= face.list_size;
      for (std::uint32_t i = 0; i < face.list_size; ++i) {
        const std::uint32_t t = lists_[face.list + i];
        if (carried_[t].stamp == patch_) continue;
        carried_[t].stamp = patch_;
        items_.push_back(t);
        for (const VertexId v : carried_[t].corners) prefetch(&vertices_[v]);
      }
    }
  }

  void make_star() {
    star_.clear();
    star_faces_.clear();
    extent_ = 0.0F;
    const glm::vec3 centre = places_[root_];
    const auto around_begin = static_cast<std::uint32_t>(around_pool_.size());
    for (const std::uint32_t f : covered_) {
      Face& face = faces_[f];
      int members = 0;
      int at = 0;
      for (int i = 0; i < 3; ++i) {
        if (member_[face.corners[i]] != patch_) continue;
        ++members;
        at = i;
      }
      if (members != 1) {
        face.corners[0] = kNone;
        continue;
      }
      face.corners[at] = root_;
      face.local = star_.count();
      const glm::vec3 b = places_[face.corners[(at + 1) % 3]] - centre;
      const glm::vec3 c = places_[face.corners[(at + 2) % 3]] - centre;
      reach(b);
      star_.add(b, c);
      star_faces_.push_back(f);
      around_pool_.push_back(f);
    }
    around_[root_] = {around_begin, static_cast<std::uint32_t>(around_pool_.size()) - around_begin};
  }

  void reach(const glm::vec3& p) { extent_ = std::max({extent_, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}); }

  bool is_covered(std::uint32_t face) const { return faces_[face].stamp == patch_; }

  // The nearest face of the star for each vertex of which a corner is to be carried on.
  void find_nearest() {
    const glm::vec3 centre = places_[root_];
    float most = 0.0F;
    for (const std::uint32_t t : items_) {
      const CarriedTriangle& carried = carried_[t];
      for (int i = 0; i < 3; ++i) {
        Vertex& vertex = vertices_[carried.corners[i]];
        if (vertex.stamp == patch_ || !is_covered(carried.faces[i])) continue;
        const StarDistance::Nearest nearest = star_.nearest(vertex.place - centre);
        vertex.stamp = patch_;
        vertex.squared = nearest.squared;
        vertex.face = nearest.face;
        most = std::max(most, nearest.squared);
      }
    }
    carrier_.begin(star_, most);
  }

  void carry(CarriedTriangle& triangle) {
    const glm::vec3 centre = places_[root_];
    TriangleInStar at;
    for (int i = 0; i < 3; ++i) {
      const Vertex& vertex = vertices_[triangle.corners[i]];
      at.points[i] = vertex.place - centre;
      reach(at.points[i]);
      at.inside[i] = is_covered(triangle.faces[i]);
      at.faces[i] = vertex.face;
      at.squared[i] = vertex.squared;
    }
    if (at.inside[0] && at.inside[1] && at.inside[2] && triangle.is_whole() &&
        faces_[triangle.faces[0]].corners[0] != kNone) {
      at.before = faces_[triangle.faces[0]].local;
    }
    carrier_.carry(triangle, at);
    for (int i = 0; i < 3; ++i) {
      if (at.inside[i]) triangle.faces[i] = star_faces_[at.faces[i]];
    }
  }

  NormalCone cone() const {
    glm::vec3 sum(0.0F);
    for (const std::uint32_t t : items_) sum += carried_[t].normal;
    NormalCone cone;
    const float length = glm::length(sum);
    if (!(length > 0.0F)) return cone;
    cone.axis = sum / length;
    float least = 1.0F;
    for (const std::uint32_t t : items_) {
      const glm::vec3& normal = carried_[t].normal;
      if (normal != glm::vec3(0.0F)) least = std::min(least, glm::dot(normal, cone.axis));
    }
    cone.cosine = std::max(-1.0F, least - 1e-6F);
    return cone;
  }

  void rewrite_lists() {
    for (const std::uint32_t f : star_faces_) faces_[f].list_size = 0;
    const auto for_each_entry = [&](auto&& entry) {
      for (const std::uint32_t t : items_) {
        const auto& on = carried_[t].faces;
        if (is_covered(on[0])) entry(t, on[0]);
        if (on[1] != on[0] && is_covered(on[1])) entry(t, on[1]);
        if (on[2] != on[0] && on[2] != on[1] && is_covered(on[2])) entry(t, on[2]);
      }
    };
    for_each_entry([&](std::uint32_t, std::uint32_t f) { ++faces_[f].list_size; });
    auto end = static_cast<std::uint32_t>(lists_.size());
    for (const std::uint32_t f : star_faces_) {
      faces_[f].list = end;
      end += faces_[f].list_size;
      listed_ += faces_[f].list_size;
      faces_[f].list_size = 0;
    }
    lists_.resize(end);
    for_each_entry([&](std::uint32_t t, std::uint32_t f) { lists_[faces_[f].list + faces_[f].list_size++] = t; });
  }

  void compact_lists() {
    std::vector<std::uint32_t> kept;
    kept.reserve(listed_ + listed_ / 2);
    for (Face& face : faces_) {
      if (face.corners[0] == kNone) continue;
      const auto begin = static_cast<std::uint32_t>(kept.size());
      kept.insert(kept.end(), lists_.begin() + face.list, lists_.begin() + face.list + face.list_size);
      face.list = begin;
    }
    lists_ = std::move(kept);
  }

  const CodedHistory& coded_;
  const PositionGrid& grid_;
  glm::dvec3 origin_{0.0};
  std::vector<GridPoint> codes_;   // by vertex, as merges leave them
  std::vector<glm::vec3> places_;  // likewise, in grid steps
  std::vector<Vertex> vertices_;
  std::vector<CarriedTriangle> carried_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> lists_;  // triangles by the face that carries a piece of them
  std::size_t listed_ = 0;            // entries of lists_ in use
  std::vector<Range> around_;         // by vertex: its faces, dead ones among them
  std::vector<std::uint32_t> around_pool_;
  std::vector<std::uint32_t> member_;         // by vertex: the patch whose root it is or is absorbed by
  std::vector<std::uint32_t> patch_of_root_;  // by vertex: its last patch

  // Of a generation.
  std::uint32_t first_patch_ = 0;
  std::vector<VertexId> roots_;
  std::vector<std::uint32_t> absorbed_begin_;  // by patch, into absorbed_
  std::vector<VertexId> absorbed_;

  // Of a patch.
  std::uint32_t patch_ = 0;
  VertexId root_ = 0;
  std::vector<std::uint32_t> covered_;
  std::vector<std::uint32_t> items_;
  std::vector<std::uint32_t> star_faces_;
  StarDistance star_;
  TriangleCarrier carrier_;
  float extent_ = 0.0F;

  SurfaceErrors result_;
};

}  // namespace

SurfaceErrors measure_surface(const std::vector<Triangle>& triangles, std::vector<GridPoint> places,
                              const PositionGrid& grid, const CodedHistory& coded) {
  return SurfaceTracker(triangles, std::move(places), grid, coded).run();
}

}  // namespace fanstream
