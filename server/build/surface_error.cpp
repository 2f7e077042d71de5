#include "server/build/surface_error.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "server/build/carried_triangle.h"
#include "server/build/prefetch.h"

namespace fanstream {
namespace {

// The largest errors found so far in this and the last generation, by region of a few dozen patches.
class UsualErrors {
 public:
  void begin_generation() {
    now_.swap(last_);
    last_size_ = size_;
    size_ = count_ > 0 ? kPatches * static_cast<float>(sum_ / count_) : size_;
    now_.assign(std::size_t{1} << kBits, 0.0F);
    last_.resize(std::size_t{1} << kBits);
    sum_ = 0.0;
    count_ = 0;
  }
  float value(const glm::vec3& place) const {
    return std::max(now_[slot(place, size_)], last_[slot(place, last_size_)]);
  }
  void raise(const glm::vec3& place, float error, float extent) {
    float& value = now_[slot(place, size_)];
    value = std::max(value, error);
    sum_ += extent;
    ++count_;
  }

 private:
  static constexpr int kBits = 14;
  static constexpr float kPatches = 6.0F;
  // Regions that share a slot share their errors.
  static std::size_t slot(const glm::vec3& place, float size) {
    const auto whole = [&](float v) { return static_cast<std::uint32_t>(static_cast<std::int32_t>(v / size)); };
    const std::uint32_t hash =
        whole(place.x) * 0x9E3779B1U ^ whole(place.y) * 0x85EBCA77U ^ whole(place.z) * 0xC2B2AE3DU;
    return (hash ^ hash >> 15U) & ((1U << kBits) - 1U);
  }

  std::vector<float> now_, last_;
  float size_ = 1000.0F;  // edge of a region
  float last_size_ = 1000.0F;
  double sum_ = 0.0;
  std::uint32_t count_ = 0;
};

class SurfaceTracker {
 public:
  SurfaceTracker(const std::vector<Triangle>& triangles, std::vector<GridPoint> places, const PositionGrid& grid,
                 const CodedHistory& coded)
      : coded_(coded), grid_(grid), codes_(std::move(places)) {
    place_vertices(triangles);
    place_triangles(triangles);
  }

  SurfaceErrors run() {
    result_.patch_of.resize(coded_.history.merges.size());
    const MergeHistory& history = coded_.history;
    for (std::uint32_t k = 0; k < history.generation_count(); ++k) {
      gather_patches(k);
      usual_.begin_generation();
      for (const std::uint32_t p : order_) measure_patch(p);
      if (getenv("V"))
        printf("gen %u patches %zu items %ld mixed %ld tries %ld cuts %ld joins %ld carried %zu listed %zu\n", k,
               roots_.size(), n_items, n_mixed, n_try, n_cut, n_join, carried_.size(), listed_);
      n_items = n_try = n_cut = n_join = n_mixed = 0;
      if (lists_.size() > 2 * listed_ + 1024) compact_lists();
    }
    return std::move(result_);
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr float kSlack = 1.1F;
  static constexpr std::uint32_t kMostDepth = 7;

  struct alignas(32) Vertex {
    glm::vec3 place{0.0F};        // in the full model
    float squared = 0.0F;         // from the nearest face of the star at hand
    std::uint32_t face = 0;       // which that is
    std::uint32_t stamp = kNone;  // the patch for which this was found
    std::uint32_t distances = 0;  // where those from all faces begin
  };
  struct Face {
    std::uint32_t corners[3];
    std::uint32_t list = 0;  // what it carries: a range of lists_
    std::uint32_t list_size = 0;
    std::uint32_t stamp = kNone;  // the last patch that covered it
    std::uint32_t local = 0;      // its number in the star at hand
  };
  struct Loose {
    std::uint32_t triangle = 0;
    std::uint32_t depth = 0;
  };
  struct StarFace {
    std::uint32_t face;
    VertexId from, to;
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

  // Where a point lies on a curve through the model's box that keeps neighbours together (Morton).
  static std::uint64_t place_on_curve(const glm::vec3& place) {
    const auto spread = [](float value) {
      std::uint64_t bits = static_cast<std::uint32_t>(value);
      bits = (bits | bits << 32U) & 0x001F00000000FFFFU;
      bits = (bits | bits << 16U) & 0x001F0000FF0000FFU;
      bits = (bits | bits << 8U) & 0x100F00F00F00F00FU;
      bits = (bits | bits << 4U) & 0x10C30C30C30C30C3U;
      return (bits | bits << 2U) & 0x1249249249249249U;
    };
    return spread(place.x) | spread(place.y) << 1U | spread(place.z) << 2U;
  }

  // Patches work through all of the full model again and again: what lies together is stored together.
  void place_vertices(const std::vector<Triangle>& triangles) {
    origin_ = grid_.decode(GridPoint(0));
    struct Entry {
      std::uint64_t at;
      VertexId v;
    };
    std::vector<Entry> entries(codes_.size());
    for (VertexId v = 0; v < entries.size(); ++v) entries[v] = {place_on_curve(value_of(codes_[v])), v};
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return a.at != b.at ? a.at < b.at : a.v < b.v; });
    number_.resize(codes_.size());
    places_.resize(codes_.size());
    vertices_.resize(codes_.size());
    for (std::uint32_t i = 0; i < entries.size(); ++i) {
      number_[entries[i].v] = i;
      places_[i] = vertices_[i].place = value_of(codes_[entries[i].v]);
    }
    around_.resize(codes_.size());
    member_.assign(codes_.size(), kNone);
    patch_of_root_.assign(codes_.size(), kNone);
    for (const Triangle& t : triangles) {
      for (const VertexId v : t) ++around_[number_[v]].size;
    }
    std::uint32_t begin = 0;
    for (Range& range : around_) {
      range.begin = begin;
      begin += range.size;
      range.size = 0;
    }
    around_pool_.resize(begin);
  }

  // By their smallest vertices.
  void place_triangles(const std::vector<Triangle>& triangles) {
    std::vector<std::uint32_t> first(codes_.size() + 1, 0);
    const auto smallest = [&](const Triangle& t) { return std::min({number_[t[0]], number_[t[1]], number_[t[2]]}); };
    for (const Triangle& t : triangles) ++first[smallest(t) + 1];
    for (std::size_t v = 0; v < codes_.size(); ++v) first[v + 1] += first[v];
    carried_.resize(triangles.size());
    faces_.resize(triangles.size());
    lists_.resize(triangles.size());
    listed_ = triangles.size();
    for (const Triangle& t : triangles) {
      const std::uint32_t f = first[smallest(t)]++;
      CarriedTriangle& carried = carried_[f];
      for (int i = 0; i < 3; ++i) carried.corners[i] = faces_[f].corners[i] = number_[t[i]];
      carried.faces[0] = f;
      const glm::dvec3 a(places_[carried.corners[0]]);
      const glm::dvec3 normal =
          glm::cross(glm::dvec3(places_[carried.corners[1]]) - a, glm::dvec3(places_[carried.corners[2]]) - a);
      const double length = glm::length(normal);
      carried.normal = length > 0.0 ? glm::vec3(normal / length) : glm::vec3(0.0F);
      faces_[f].list = f;
      faces_[f].list_size = 1;
      lists_[f] = f;
    }
    for (std::uint32_t f = 0; f < triangles.size(); ++f) {
      for (const VertexId v : faces_[f].corners) around_pool_[around_[v].begin + around_[v].size++] = f;
    }
  }

  // The roots of a generation, the vertices each absorbs, and the roots' places afterwards.
  void gather_patches(std::uint32_t k) {
    const MergeHistory& history = coded_.history;
    roots_.clear();
    root_codes_.clear();
    const std::uint32_t begin = history.generation_begin[k];
    const std::uint32_t end = history.generation_begin[k + 1];
    first_patch_ = static_cast<std::uint32_t>(result_.patches.size());
    for (std::uint32_t m = begin; m < end; ++m) {
      const MergeRecord& merge = history.merges[m];
      const VertexId root = number_[merge.root];
      std::uint32_t& patch = patch_of_root_[root];
      if (patch == kNone || patch < first_patch_) {
        patch = first_patch_ + static_cast<std::uint32_t>(roots_.size());
        roots_.push_back(root);
        root_codes_.push_back(merge.root);
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
      absorbed_[--absorbed_begin_[result_.patch_of[m] - first_patch_ + 1]] = number_[history.merges[m].removed];
    }
    // Every count above has become the beginning of the patch before it.
    for (std::size_t p = 0; p < roots_.size(); ++p) absorbed_begin_[p] = absorbed_begin_[p + 1];
    absorbed_begin_[roots_.size()] = end - begin;
    for (std::size_t p = 0; p < roots_.size(); ++p) places_[roots_[p]] = value_of(codes_[root_codes_[p]]);
    order_.resize(roots_.size());
    for (std::uint32_t p = 0; p < order_.size(); ++p) order_[p] = p;
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return roots_[a] < roots_[b]; });
  }

  void measure_patch(std::size_t p) {
    patch_ = first_patch_ + static_cast<std::uint32_t>(p);
    root_ = roots_[p];
    cover(std::span(absorbed_).subspan(absorbed_begin_[p], absorbed_begin_[p + 1] - absorbed_begin_[p]));
    gather_carried();
    make_star();
    find_nearest();
    carry_all();
    usual_.raise(places_[root_], std::sqrt(carrier_.lower()), extent_);
    const float error = std::sqrt(carrier_.upper()) + StarDistance::kMargin * extent_ + rounding_;
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
    has_parts_ = false;
    for (const std::uint32_t f : covered_) {
      const Face& face = faces_[f];
      listed_ -= face.list_size;
      for (std::uint32_t i = 0; i < face.list_size; ++i) gather(lists_[face.list + i]);
    }
    if (has_parts_) join_parts();
  }

  void gather(std::uint32_t t) {
    CarriedTriangle& triangle = carried_[t];
    if (triangle.stamp == patch_) return;
    triangle.stamp = patch_;
    if (triangle.child_count == 0) {
      if (triangle.parent != kNone) {
        if (!is_touched(triangle)) return;
        has_parts_ = true;
      }
      items_.push_back(t);
      for (const VertexId v : triangle.corners) prefetch(&vertices_[v]);
      return;
    }
    for (std::uint32_t i = 0; i < triangle.child_count; ++i) gather(triangle.children + i);
  }

  // Parts that have all come together in this patch are needed no longer.
  void join_parts() {
    std::size_t kept = 0;
    const std::size_t count = items_.size();
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t t = items_[i];
      const std::uint32_t parent = carried_[t].parent;
      if (parent == kNone || !are_parts_inside(parent)) {
        items_[kept++] = t;
      } else if (t == carried_[parent].children) {
        items_.push_back(parent);  // behind the others, so that only its own parts' first is replaced by it
      }
    }
    items_.erase(items_.begin() + static_cast<std::ptrdiff_t>(kept),
                 items_.begin() + static_cast<std::ptrdiff_t>(count));
    for (std::size_t i = kept; i < items_.size(); ++i) join(items_[i]);
  }

  // Whether the parts of a triangle are all carried by covered faces and have no parts themselves.
  bool are_parts_inside(std::uint32_t t) const {
    const CarriedTriangle& triangle = carried_[t];
    for (std::uint32_t i = 0; i < triangle.child_count; ++i) {
      const CarriedTriangle& part = carried_[triangle.children + i];
      if (part.child_count != 0) return false;
      if (!is_inside(part)) return false;
    }
    return true;
  }

  void join(std::uint32_t t) {
    CarriedTriangle& triangle = carried_[t];
    const std::uint32_t face = carried_[triangle.children].faces[0];
    for (std::uint32_t i = 0; i < triangle.child_count; ++i) {
      for (const VertexId v : carried_[triangle.children + i].corners) {
        const bool own =
            v >= codes_.size() && v != triangle.corners[0] && v != triangle.corners[1] && v != triangle.corners[2];
        if (own && vertices_[v].face != kNone) {
          vertices_[v].face = kNone;  // handed back once
          free_vertices_.push_back(v);
        }
      }
    }
    ++n_join;
    free_parts_[triangle.child_count].push_back(triangle.children);
    triangle.child_count = 0;
    triangle.children = kNone;
    triangle.cut = Cut::whole;
    triangle.faces[0] = face;
  }

  void make_star() {
    rest_.clear();
    for (const std::uint32_t f : covered_) {
      Face& face = faces_[f];
      int members = 0;
      int at = 0;
      for (int i = 0; i < 3; ++i) {
        if (member_[face.corners[i]] != patch_) continue;
        ++members;
        at = i;
      }
      if (members == 1) {
        rest_.push_back({f, face.corners[(at + 1) % 3], face.corners[(at + 2) % 3]});
      } else {
        face.corners[0] = kNone;
      }
    }
    order_rest();
    star_.clear();
    star_faces_.clear();
    extent_ = 0.0F;
    const auto around_begin = static_cast<std::uint32_t>(around_pool_.size());
    for (const StarFace& f : rest_) {
      faces_[f.face].local = star_.count();
      faces_[f.face].corners[0] = root_;
      faces_[f.face].corners[1] = f.from;
      faces_[f.face].corners[2] = f.to;
      const glm::vec3 b = places_[f.from] - places_[root_];
      reach(b);
      star_.add(b, places_[f.to] - places_[root_]);
      reach(places_[f.to] - places_[root_]);
      star_faces_.push_back(f.face);
      around_pool_.push_back(f.face);
    }
    star_.finish(rest_.size() > 2 && rest_.back().to == rest_.front().from);
    around_[root_] = {around_begin, static_cast<std::uint32_t>(around_pool_.size()) - around_begin};
  }

  // Around the root; an open star from its first face on.
  void order_rest() {
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      const VertexId from = rest_[i].from;
      if (std::none_of(rest_.begin(), rest_.end(), [&](const StarFace& f) { return f.to == from; })) {
        std::swap(rest_[0], rest_[i]);
        break;
      }
    }
    for (std::size_t i = 1; i < rest_.size(); ++i) {
      const VertexId wanted = rest_[i - 1].to;
      for (std::size_t k = i; k < rest_.size(); ++k) {
        if (rest_[k].from != wanted) continue;
        std::swap(rest_[i], rest_[k]);
        break;
      }
    }
  }

  void reach(const glm::vec3& p) { extent_ = std::max({extent_, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}); }

  bool is_covered(std::uint32_t face) const { return faces_[face].stamp == patch_; }
  bool is_inside(const CarriedTriangle& triangle) const {
    for (int p = 0; p < triangle.piece_count(); ++p) {
      if (!is_covered(triangle.faces[p])) return false;
    }
    return true;
  }
  bool is_touched(const CarriedTriangle& triangle) const {
    for (int p = 0; p < triangle.piece_count(); ++p) {
      if (is_covered(triangle.faces[p])) return true;
    }
    return false;
  }

  // The nearest face of the star for each vertex of which a corner is to be carried on. Triangles whose corners are all
  // nearest to the same face are done with that.
  void find_nearest() {
    mixed_.clear();
    distances_used_ = 0;
    float most = 0.0F;
    for (const std::uint32_t t : items_) {
      CarriedTriangle& triangle = carried_[t];
      bool all = true;
      for (int i = 0; i < 3; ++i) {
        if (is_covered(triangle.faces[triangle.piece_of_corner(i)])) {
          most = std::max(most, nearest_to(triangle.corners[i]));
        } else {
          all = false;
        }
      }
      const std::uint32_t face = vertices_[triangle.corners[0]].face;
      if (all && vertices_[triangle.corners[1]].face == face && vertices_[triangle.corners[2]].face == face &&
          (triangle.cut != Cut::strips || is_covered(triangle.faces[1]))) {
        triangle.cut = Cut::whole;
        triangle.faces[0] = star_faces_[face];
      } else {
        mixed_.push_back(t);
      }
    }
    n_items += items_.size();
    n_mixed += mixed_.size();
    const float usual = usual_.value(places_[root_]);
    carrier_.begin(star_, most, usual * usual);
  }

  float nearest_to(VertexId v) {
    Vertex& vertex = vertices_[v];
    if (vertex.stamp == patch_) return vertex.squared;
    const std::size_t begin = distances_used_;
    distances_used_ += star_.stored();
    if (distances_.size() < distances_used_) distances_.resize(2 * distances_used_);
    const StarDistance::Nearest nearest = star_.nearest(vertex.place - places_[root_], distances_.data() + begin);
    vertex.distances = static_cast<std::uint32_t>(begin);
    vertex.stamp = patch_;
    vertex.squared = nearest.squared;
    vertex.face = nearest.face;
    reach(vertex.place - places_[root_]);
    return nearest.squared;
  }

  // A bound that is a fifth above what is there for sure is good enough.
  float enough() const {
    const float distance = kSlack * std::sqrt(std::max(carrier_.lower(), carrier_.usual())) + 0.25F;
    return std::max(carrier_.upper(), distance * distance);
  }

  void carry_all() {
    loose_.clear();
    for (const std::uint32_t t : mixed_) {
      if (!carry(t, false)) loose_.push_back({t, 0});
    }
    rounding_ = has_parts_ || !loose_.empty() ? part_rounding() : 0.0F;
    while (!loose_.empty()) {
      const Loose loose = loose_.back();
      loose_.pop_back();
      if (!carry(loose.triangle, loose.depth == kMostDepth)) cut(loose.triangle, loose.depth);
    }
  }

  // Corners of parts are rounded to floats.
  float part_rounding() const {
    const glm::vec3& p = places_[root_];
    return 2e-7F * (std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}) + extent_);
  }

  TriangleInStar in_star(const CarriedTriangle& triangle) {
    TriangleInStar at;
    for (int i = 0; i < 3; ++i) {
      const Vertex& vertex = vertices_[triangle.corners[i]];
      at.points[i] = vertex.place - places_[root_];
      reach(at.points[i]);
      at.nearest[i] = vertex.face;
      at.squared[i] = vertex.squared;
      if (vertex.stamp == patch_) at.distances[i] = distances_.data() + vertex.distances;
    }
    at.all_inside = true;
    for (int p = 0; p < triangle.piece_count(); ++p) {
      at.inside[p] = is_covered(triangle.faces[p]);
      at.all_inside = at.all_inside && at.inside[p];
    }
    return at;
  }

  // Hands a triangle on; unless it must, not where that would make the patch's bound loose. Returns whether it has.
  bool carry(std::uint32_t t, bool must) {
    TriangleInStar at = in_star(carried_[t]);
    CarriedTriangle carried = carried_[t];
    ++n_try;
    const float squared = carrier_.carry(carried, at);
    if (squared > enough() && !must) return false;
    carrier_.accept(squared);
    for (int p = 0; p < carried.piece_count(); ++p) {
      if (at.all_inside || at.inside[p]) carried.faces[p] = star_faces_[at.faces[p]];
    }
    carried_[t] = carried;
    return true;
  }

  VertexId add_vertex(const glm::vec3& place) {
    VertexId v = static_cast<VertexId>(vertices_.size());
    if (free_vertices_.empty()) {
      vertices_.emplace_back();
    } else {
      v = free_vertices_.back();
      free_vertices_.pop_back();
    }
    vertices_[v] = {place, 0.0F, 0, kNone, 0};
    return v;
  }

  struct Part {
    VertexId corners[3];
    std::uint32_t face;
  };

  // Parts that lie in one piece each, and then quarters.
  void cut(std::uint32_t t, std::uint32_t depth) {
    const TriangleInStar at = in_star(carried_[t]);
    parts_.clear();
    ++n_cut;
    if (at.all_inside) {
      cut_whole(carried_[t], at);
    } else {
      cut_pieces(carried_[t], at);
    }
    const auto count = static_cast<std::uint8_t>(parts_.size());
    std::uint32_t first = static_cast<std::uint32_t>(carried_.size());
    if (free_parts_[count].empty()) {
      carried_.resize(carried_.size() + count);
    } else {
      first = free_parts_[count].back();
      free_parts_[count].pop_back();
    }
    CarriedTriangle& triangle = carried_[t];
    triangle.children = first;
    triangle.child_count = count;
    for (std::uint32_t i = 0; i < count; ++i) {
      CarriedTriangle& part = carried_[first + i];
      part = {};
      part.normal = triangle.normal;
      part.parent = t;
      part.stamp = patch_;
      std::copy_n(parts_[i].corners, 3, part.corners);
      part.faces[0] = parts_[i].face;
      if (!is_covered(parts_[i].face)) continue;
      for (const VertexId v : part.corners) carrier_.raise(nearest_to(v));
      items_.push_back(first + i);
      loose_.push_back({first + i, depth + 1});
    }
  }

  // At the root if it lies above the triangle; else where the plane through an edge of the star cuts it best; else into
  // quarters.
  void cut_whole(const CarriedTriangle& triangle, const TriangleInStar& at) {
    const glm::vec2 above = centre_above(at.points);
    if (std::min({above.x, above.y, 1.0F - above.x - above.y}) > 0.05F) {
      cut_above_root(triangle, at, above);
    } else if (const EdgePlane plane = best_plane(at); plane.share > 0.05F) {
      cut_along(triangle, at, plane.sides);
    } else {
      quarter(triangle, at);
    }
  }

  void cut_above_root(const CarriedTriangle& triangle, const TriangleInStar& at, const glm::vec2& above) {
    const VertexId centre = add_vertex(places_[root_] + at.points[0] + above.x * (at.points[1] - at.points[0]) +
                                       above.y * (at.points[2] - at.points[0]));
    for (int e = 0; e < 3; ++e) add_part(triangle, centre, triangle.corners[e], triangle.corners[(e + 1) % 3]);
  }

  struct EdgePlane {
    glm::vec3 sides{0.0F};  // how far the corners are on the one side of it
    float share = 0.0F;     // of the triangle, by its extent across the plane, on the side that has less
  };

  EdgePlane best_plane(const TriangleInStar& at) const {
    EdgePlane best;
    const glm::vec3 middle = at.points[0] + at.points[1] + at.points[2];
    for (std::uint32_t f = 0; f < star_.count(); ++f) {
      if (star_.after(f) == StarDistance::kNoFace) continue;
      const glm::vec3 edge = places_[rest_[f].to] - places_[root_];
      if (glm::dot(edge, middle) <= 0.0F) continue;  // of its other half
      const glm::vec3 sides(star_.side(at.points[0], f), star_.side(at.points[1], f), star_.side(at.points[2], f));
      const float most = std::max({sides.x, sides.y, sides.z});
      const float least = std::min({sides.x, sides.y, sides.z});
      const float share = std::min(most, -least) / (most - least);
      if (share > best.share) best = {sides, share};
    }
    return best;
  }

  void cut_along(const CarriedTriangle& triangle, const TriangleInStar& at, const glm::vec3& sides) {
    const float nothing = 1e-3F * std::max({std::fabs(sides.x), std::fabs(sides.y), std::fabs(sides.z)});
    const auto crossing = [&](int from, int to) {
      return add_vertex(places_[root_] + at.points[from] +
                        sides[from] / (sides[from] - sides[to]) * (at.points[to] - at.points[from]));
    };
    const auto& corners = triangle.corners;
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3;
      const int j = (k + 2) % 3;
      if (std::fabs(sides[k]) <= nothing) {
        const VertexId across = crossing(i, j);
        add_part(triangle, corners[k], corners[i], across);
        add_part(triangle, corners[k], across, corners[j]);
        return;
      }
    }
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3;
      const int j = (k + 2) % 3;
      if ((sides[i] > 0.0F) != (sides[j] > 0.0F)) continue;
      const VertexId to_i = crossing(k, i);
      const VertexId to_j = crossing(k, j);
      add_part(triangle, corners[k], to_i, to_j);
      add_part(triangle, to_i, corners[i], corners[j]);
      add_part(triangle, to_i, corners[j], to_j);
      return;
    }
  }

  void quarter(const CarriedTriangle& triangle, const TriangleInStar& at) {
    VertexId middle[3];
    for (int e = 0; e < 3; ++e) middle[e] = add_vertex(places_[root_] + 0.5F * (at.points[e] + at.points[(e + 1) % 3]));
    for (int e = 0; e < 3; ++e) add_part(triangle, triangle.corners[e], middle[e], middle[(e + 2) % 3]);
    add_part(triangle, middle[0], middle[1], middle[2]);
  }

  void add_part(const CarriedTriangle& whole, VertexId a, VertexId b, VertexId c) {
    parts_.push_back({{a, b, c}, whole.faces[0]});
  }

  void cut_pieces(const CarriedTriangle& triangle, const TriangleInStar& at) {
    for (int p = 0; p < triangle.piece_count(); ++p) {
      const Piece piece = piece_of(triangle, at.points, p);
      VertexId corners[5];
      for (int i = 0; i < piece.count; ++i) corners[i] = vertex_at(triangle, at, piece.points[i]);
      for (int i = 1; i + 1 < piece.count; ++i) {
        parts_.push_back({{corners[0], corners[i], corners[i + 1]}, triangle.faces[p]});
      }
    }
  }

  // Of the triangle's own corners, or of the parts made before.
  VertexId vertex_at(const CarriedTriangle& triangle, const TriangleInStar& at, const glm::vec3& point) {
    for (int c = 0; c < 3; ++c) {
      if (at.points[c] == point) return triangle.corners[c];
    }
    const glm::vec3 place = point + places_[root_];
    for (const Part& part : parts_) {
      for (const VertexId v : part.corners) {
        if (vertices_[v].place == place) return v;
      }
    }
    return add_vertex(place);
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
        if (carried_[t].child_count != 0) continue;
        const auto& on = carried_[t].faces;
        const int count = carried_[t].piece_count();
        if (is_covered(on[0])) entry(t, on[0]);
        if (count > 1 && on[1] != on[0] && is_covered(on[1])) entry(t, on[1]);
        if (count > 2 && on[2] != on[0] && on[2] != on[1] && is_covered(on[2])) entry(t, on[2]);
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
  std::vector<GridPoint> codes_;   // by vertex of the history, as merges leave them
  std::vector<VertexId> number_;   // by vertex of the history: its number in all that follows
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
  std::vector<VertexId> root_codes_;           // the roots in codes_
  std::vector<std::uint32_t> order_;           // in which patches are measured: neighbours one after the other
  std::vector<std::uint32_t> absorbed_begin_;  // by patch, into absorbed_
  std::vector<VertexId> absorbed_;

  // Of a patch.
  std::uint32_t patch_ = 0;
  VertexId root_ = 0;
  std::vector<std::uint32_t> covered_;
  std::vector<std::uint32_t> items_;
  std::vector<std::uint32_t> mixed_;  // those of them that need a closer look
  std::vector<StarFace> rest_;
  std::vector<std::uint32_t> star_faces_;
  StarDistance star_;
  std::vector<float> distances_;  // of vertices from all faces of the star
  std::size_t distances_used_ = 0;
  TriangleCarrier carrier_;
  UsualErrors usual_;
  float extent_ = 0.0F;    // largest coordinate seen from the centre
  float rounding_ = 0.0F;  // of the corners of parts
  bool has_parts_ = false;
  std::vector<Loose> loose_;
  long n_items = 0, n_try = 0, n_cut = 0, n_join = 0, n_mixed = 0;
  std::vector<Part> parts_;

  std::vector<std::uint32_t> free_parts_[7];  // by how many
  std::vector<VertexId> free_vertices_;

  SurfaceErrors result_;
};

}  // namespace

SurfaceErrors measure_surface(const std::vector<Triangle>& triangles, std::vector<GridPoint> places,
                              const PositionGrid& grid, const CodedHistory& coded) {
  return SurfaceTracker(triangles, std::move(places), grid, coded).run();
}

}  // namespace fanstream
