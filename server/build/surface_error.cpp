#include "server/build/surface_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <system_error>

#include "server/build/carried_surface.h"
#include "server/build/processors.h"
#include "server/build/usual_errors.h"

namespace fanstream {
namespace {

class SurfaceTracker {
 public:
  SurfaceTracker(const std::vector<Triangle>& triangles, std::vector<GridPoint> codes, const PositionGrid& grid,
                 const CodedHistory& coded)
      : step_(grid.step()), mesh_(triangles, std::move(codes), grid, coded), surface_(mesh_) {}

  SurfaceErrors run() {
    mesh_.run(
        [&](std::uint32_t patches) {
          result_.patches.resize(patches);
          usual_.begin_generation();
        },
        [&](std::uint32_t patch) { measure(patch); });
    result_.patch_of = mesh_.patch_of_merge();
    return std::move(result_);
  }

 private:
  // A bound is good enough that is this much above a distance which is there for sure, or above this share of what is
  // usual around: by a factor, and in grid steps.
  static constexpr float kUsualShare = 0.8F;
  static constexpr float kSlack = 1.03F;
  static constexpr float kSlackSteps = 0.1F;
  static constexpr std::uint32_t kMostDepth = 7;  // of cuts within cuts, in one patch
  static constexpr std::size_t kManyItems = 4096;

  struct Loose {
    std::uint32_t triangle = 0;
    std::uint32_t depth = 0;
  };

  void measure(std::uint32_t patch) {
    patch_ = patch;
    extent_ = mesh_.extent();
    surface_.gather(patch);
    find_nearest();
    carry_mixed();
    usual_.raise(mesh_.centre(), std::sqrt(carrier_.lower()), extent_);
    const float error = std::sqrt(carrier_.upper()) + StarDistance::kMargin * extent_ + part_rounding();
    result_.patches[patch].error =
        std::nextafter(static_cast<float>(error * step_), std::numeric_limits<float>::infinity());
    result_.patches[patch].normals = cone();
    surface_.rewrite_lists();
  }

  void reach(const glm::vec3& p) { extent_ = std::max({extent_, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}); }

  // The nearest face of the star for each vertex with a piece inside. Triangles whose corners are all nearest to the
  // same face are done with that.
  void find_nearest() {
    mixed_.clear();
    keep_distances_ = surface_.items().size() < kManyItems;
    distances_used_ = 0;
    float most = 0.0F;
    for (const std::uint32_t t : surface_.items()) {
      CarriedTriangle& triangle = surface_.triangle(t);
      bool all = triangle.cut != Cut::strips || mesh_.is_covered(triangle.faces[1]);
      for (int i = 0; i < 3; ++i) {
        if (mesh_.is_covered(triangle.faces[triangle.piece_of_corner(i)])) {
          most = std::max(most, nearest_to(triangle.corners[i]));
        } else {
          all = false;
        }
      }
      const auto face = [&](int i) { return surface_.vertex(triangle.corners[i]).face; };
      if (all && face(0) == face(1) && face(1) == face(2)) {
        triangle.cut = Cut::whole;
        triangle.faces[0] = mesh_.star_faces()[face(0)];
      } else {
        mixed_.push_back(t);
      }
    }
    const float usual = kUsualShare * usual_.value(mesh_.centre());
    carrier_.begin(mesh_.star(), most, usual * usual);
  }

  float* room_for_distances(std::size_t begin) {
    const std::size_t end = begin + mesh_.star().stored();
    if (distances_.size() < end) distances_.resize(2 * end);
    return distances_.data() + begin;
  }

  float nearest_to(VertexId v) {
    CarriedSurface::Vertex& vertex = surface_.vertex(v);
    if (vertex.stamp == patch_) return vertex.squared;
    const glm::vec3 at = vertex.place - mesh_.centre();
    const StarDistance::Nearest nearest = mesh_.star().nearest(at, room_for_distances(distances_used_));
    vertex.stamp = patch_;
    vertex.squared = nearest.squared;
    vertex.face = nearest.face;
    vertex.distances = static_cast<std::uint32_t>(distances_used_);
    if (keep_distances_) distances_used_ += mesh_.star().stored();
    reach(at);
    return nearest.squared;
  }

  TriangleInStar in_star(const CarriedTriangle& triangle) {
    TriangleInStar at = surface_.in_star(triangle);
    room_for_distances(2 * std::size_t{mesh_.star().stored()});
    for (int i = 0; i < 3; ++i) {
      const CarriedSurface::Vertex& vertex = surface_.vertex(triangle.corners[i]);
      reach(at.points[i]);
      if (vertex.stamp != patch_) continue;
      at.nearest[i] = vertex.face;
      at.squared[i] = vertex.squared;
      std::size_t begin = vertex.distances;
      if (!keep_distances_) {
        begin = i * std::size_t{mesh_.star().stored()};
        mesh_.star().nearest(at.points[i], distances_.data() + begin);
      }
      at.distances[i] = distances_.data() + begin;
    }
    return at;
  }

  void carry_mixed() {
    loose_.clear();
    for (const std::uint32_t t : mixed_) {
      if (!carry(t, false)) loose_.push_back({t, 0});
    }
    has_parts_ = surface_.has_parts() || !loose_.empty();
    while (!loose_.empty()) {
      const Loose loose = loose_.back();
      loose_.pop_back();
      if (carry(loose.triangle, loose.depth == kMostDepth)) continue;
      for (const std::uint32_t part : surface_.cut(loose.triangle)) {
        for (const VertexId v : surface_.triangle(part).corners) carrier_.raise(nearest_to(v));
        loose_.push_back({part, loose.depth + 1});
      }
    }
  }

  float enough() const {
    const float distance = kSlack * std::sqrt(std::max(carrier_.lower(), carrier_.usual())) + kSlackSteps;
    return std::max(carrier_.upper(), distance * distance);
  }

  // Hands a triangle on; unless it must, not where that would make the patch's bound loose. Returns whether it has.
  bool carry(std::uint32_t t, bool must) {
    CarriedTriangle carried = surface_.triangle(t);
    TriangleInStar at = in_star(carried);
    const float squared = carrier_.carry(carried, at);
    if (squared > enough() && !must) return false;
    carrier_.accept(squared);
    for (int p = 0; p < carried.piece_count(); ++p) {
      if (at.all_inside || at.inside[p]) carried.faces[p] = mesh_.star_faces()[at.faces[p]];
    }
    surface_.triangle(t) = carried;
    return true;
  }

  // Corners of parts are rounded to floats, those of parts of parts again.
  float part_rounding() const {
    if (!has_parts_) return 0.0F;
    const glm::vec3& p = mesh_.centre();
    return 1e-6F * (std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}) + extent_);
  }

  NormalCone cone() {
    glm::vec3 sum(0.0F);
    for (const std::uint32_t t : surface_.items()) sum += surface_.triangle(t).normal;
    NormalCone cone;
    const float length = glm::length(sum);
    if (!(length > 0.0F)) return cone;
    cone.axis = sum / length;
    float least = 1.0F;
    for (const std::uint32_t t : surface_.items()) {
      const glm::vec3& normal = surface_.triangle(t).normal;
      if (normal != glm::vec3(0.0F)) least = std::min(least, glm::dot(normal, cone.axis));
    }
    cone.cosine = std::max(-1.0F, least - 1e-6F);
    return cone;
  }

  double step_;
  PatchReplay mesh_;
  CarriedSurface surface_;
  TriangleCarrier carrier_;
  UsualErrors usual_;
  SurfaceErrors result_;

  // Of a patch.
  std::uint32_t patch_ = 0;
  std::vector<std::uint32_t> mixed_;  // items that need a closer look
  std::vector<Loose> loose_;
  bool keep_distances_ = false;
  std::vector<float> distances_;  // of vertices from all faces of the star
  std::size_t distances_used_ = 0;
  float extent_ = 0.0F;  // largest coordinate seen from the centre
  bool has_parts_ = false;
};

}  // namespace

SurfaceErrors measure_surface(const std::vector<Triangle>& triangles, std::vector<GridPoint> places,
                              const PositionGrid& grid, const CodedHistory& coded) {
  return SurfaceTracker(triangles, std::move(places), grid, coded).run();
}

std::future<SurfaceErrors> start_measuring_surface(const std::vector<Triangle>& triangles,
                                                   std::vector<GridPoint> places, const PositionGrid& grid,
                                                   const CodedHistory& coded) {
  constexpr std::size_t kWorthAThread = 30'000;
  const auto measure = [&triangles, &grid, &coded, codes = std::move(places)] {
    return measure_surface(triangles, codes, grid, coded);
  };
  if (triangles.size() >= kWorthAThread && usable_processors() > 1) {
    try {
      return std::async(std::launch::async, measure);
    } catch (const std::system_error&) {
      // No thread to be had: the caller's own will do.
    }
  }
  return std::async(std::launch::deferred, measure);
}

}  // namespace fanstream
