#include "server/build/surface_error.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <system_error>

#include "server/build/carried_surface.h"
#include "server/build/patch_replay.h"
#include "server/build/processors.h"
#include "server/build/usual_errors.h"

namespace fanstream {
namespace {

// What patches say of a part of the full model's triangles.
class SurfacePart {
 public:
  static constexpr float kUntouched = -1.0F;  // as the error of a patch whose faces carry nothing of this part

  SurfacePart(const PlacedMesh& mesh, std::uint32_t part)
      : step_(mesh.grid.step()), part_(part), surface_(mesh, part) {}

  // Generations must follow each other.
  void follow(const GenerationStars& stars) {
    result_.resize(stars.numbers_end, {kUntouched, {}});
    usual_.begin_generation();
    for (std::size_t p = 0; p < stars.patches.size(); ++p) {
      if (!stars.patches[p].concerns(part_)) continue;
      surface_.fetch(stars, p);
      if (surface_.gather(stars, p)) result_[stars.patches[p].number] = measure(stars.patches[p].number);
    }
  }

  const std::vector<PatchSurface>& result() const { return result_; }  // by patch

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

  PatchSurface measure(std::uint32_t patch) {
    patch_ = patch;
    extent_ = star().extent();
    find_nearest();
    carry_mixed();
    usual_.raise(star().centre(), std::sqrt(carrier_.lower()), extent_);
    const float error = std::sqrt(carrier_.upper()) + StarDistance::kMargin * extent_ + part_rounding();
    const PatchSurface found{std::nextafter(static_cast<float>(error * step_), std::numeric_limits<float>::infinity()),
                             cone()};
    surface_.rewrite_lists();
    return found;
  }

  const PatchStar& star() const { return surface_.star(); }
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
      bool all = triangle.cut != Cut::strips || surface_.is_covered(triangle.faces[1]);
      for (int i = 0; i < 3; ++i) {
        if (surface_.is_covered(triangle.faces[triangle.piece_of_corner(i)])) {
          most = std::max(most, nearest_to(triangle.corners[i]));
        } else {
          all = false;
        }
      }
      const auto face = [&](int i) { return surface_.vertex(triangle.corners[i]).face; };
      if (all && face(0) == face(1) && face(1) == face(2)) {
        triangle.cut = Cut::whole;
        triangle.faces[0] = star().face(face(0));
      } else {
        mixed_.push_back(t);
      }
    }
    const float usual = kUsualShare * usual_.value(star().centre());
    carrier_.begin(star().distance(), most, usual * usual);
  }

  float* room_for_distances(std::size_t begin) {
    const std::size_t end = begin + star().distance().stored();
    if (distances_.size() < end) distances_.resize(2 * end);
    return distances_.data() + begin;
  }

  float nearest_to(VertexId v) {
    CarriedSurface::Vertex& vertex = surface_.vertex(v);
    if (vertex.stamp == patch_) return vertex.squared;
    const glm::vec3 at = vertex.place - star().centre();
    const StarDistance::Nearest nearest = star().distance().nearest(at, room_for_distances(distances_used_));
    vertex.stamp = patch_;
    vertex.squared = nearest.squared;
    vertex.face = nearest.face;
    vertex.distances = static_cast<std::uint32_t>(distances_used_);
    if (keep_distances_) distances_used_ += star().distance().stored();
    reach(at);
    return nearest.squared;
  }

  TriangleInStar in_star(const CarriedTriangle& triangle) {
    TriangleInStar at = surface_.in_star(triangle);
    room_for_distances(2 * std::size_t{star().distance().stored()});
    for (int i = 0; i < 3; ++i) {
      const CarriedSurface::Vertex& vertex = surface_.vertex(triangle.corners[i]);
      reach(at.points[i]);
      if (vertex.stamp != patch_) continue;
      at.nearest[i] = vertex.face;
      at.squared[i] = vertex.squared;
      std::size_t begin = vertex.distances;
      if (!keep_distances_) {
        begin = i * std::size_t{star().distance().stored()};
        star().distance().nearest(at.points[i], distances_.data() + begin);
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
      if (at.all_inside || at.inside[p]) carried.faces[p] = star().face(at.faces[p]);
    }
    surface_.triangle(t) = carried;
    return true;
  }

  // Corners of parts are rounded to floats, those of parts of parts again.
  float part_rounding() const {
    if (!has_parts_) return 0.0F;
    const glm::vec3& p = star().centre();
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
  std::uint32_t part_;
  CarriedSurface surface_;
  TriangleCarrier carrier_;
  UsualErrors usual_;
  std::vector<PatchSurface> result_;

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

// Holds both.
NormalCone joined(const NormalCone& a, const NormalCone& b) {
  const NormalCone cones[] = {a, b};
  const std::optional<WideCone> both = cone_around(cones);
  if (!both || both->half_angle >= std::numbers::pi) return {};
  return {glm::vec3(both->axis), static_cast<float>(std::cos(both->half_angle))};
}

void join(const std::vector<PatchSurface>& part, std::vector<PatchSurface>& all) {
  for (std::size_t p = 0; p < all.size(); ++p) {
    if (part[p].error == SurfacePart::kUntouched) continue;
    all[p].normals =
        all[p].error == SurfacePart::kUntouched ? part[p].normals : joined(all[p].normals, part[p].normals);
    all[p].error = std::max(all[p].error, part[p].error);
  }
}

}  // namespace

SurfaceErrors measure_surface(const PlacedMesh& mesh, const CodedHistory& coded) {
  PatchReplay replay(mesh, coded);
  std::vector<std::unique_ptr<SurfacePart>> parts;
  for (std::uint32_t p = 0; p < mesh.part_count(); ++p) parts.push_back(std::make_unique<SurfacePart>(mesh, p));
  replay.run(parts.size(), [&](const GenerationStars& stars, std::size_t part) { parts[part]->follow(stars); });
  SurfaceErrors errors;
  errors.patch_of = replay.patch_of_merge();
  errors.patches = parts[0]->result();
  for (std::size_t p = 1; p < parts.size(); ++p) join(parts[p]->result(), errors.patches);
  for (PatchSurface& patch : errors.patches) patch.error = std::max(patch.error, 0.0F);
  return errors;
}

std::future<SurfaceErrors> start_measuring_surface(const PlacedMesh& mesh, const CodedHistory& coded) {
  const auto measure = [&mesh, &coded] { return measure_surface(mesh, coded); };
  if (threads_worth_while(mesh.faces.size()) > 1) {
    try {
      return std::async(std::launch::async, measure);
    } catch (const std::system_error&) {
      // No thread to be had: the caller's own will do.
    }
  }
  return std::async(std::launch::deferred, measure);
}

}  // namespace fanstream
