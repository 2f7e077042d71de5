#include "client/subdivide/view_subdivision.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

namespace fanstream {
namespace {

struct Facing {
  bool front = false;
  bool back = false;
};

// The picture of a view: what lies in it and how large it is there.
class Picture {
 public:
  explicit Picture(const View& view) : eye_(view.camera.eye) {
    const Camera& camera = view.camera;
    forward_ = glm::normalize(camera.target - camera.eye);
    right_ = glm::normalize(glm::cross(forward_, camera.up));
    up_ = glm::cross(right_, forward_);
    tan_y_ = std::tan(glm::radians(camera.fov_deg) / 2);
    tan_x_ = tan_y_ * view.width_px / view.height_px;
    focal_px_ = view.height_px / (2 * tan_y_);
    near_ = view.near_distance > 0 ? view.near_distance : 1e-3 * glm::length(camera.target - camera.eye);
  }

  // Right, up and depth.
  glm::dvec3 to_eye(const glm::dvec3& place) const {
    const glm::dvec3 d = place - eye_;
    return {glm::dot(d, right_), glm::dot(d, up_), glm::dot(d, forward_)};
  }

  // The sides of the view volume that the place is beyond, as bits.
  unsigned beyond(const glm::dvec3& place) const {
    const glm::dvec3 e = to_eye(place);
    return (e.x > tan_x_ * e.z ? 1U : 0U) | (-e.x > tan_x_ * e.z ? 2U : 0U) | (e.y > tan_y_ * e.z ? 4U : 0U) |
           (-e.y > tan_y_ * e.z ? 8U : 0U) | (e.z < near_ ? 16U : 0U);
  }

  // Infinite where one of the two lies behind the eye.
  double distance_px(const glm::dvec3& a, const glm::dvec3& b) const {
    const glm::dvec3 p = to_eye(a);
    const glm::dvec3 q = to_eye(b);
    if (p.z < near_ || q.z < near_) return std::numeric_limits<double>::infinity();
    return focal_px_ * std::hypot(p.x / p.z - q.x / q.z, p.y / p.z - q.y / q.z);
  }

  const glm::dvec3& eye() const { return eye_; }

 private:
  glm::dvec3 eye_, forward_{0.0}, right_{0.0}, up_{0.0};
  double tan_x_ = 1.0, tan_y_ = 1.0;
  double focal_px_ = 1.0;
  double near_ = 0.0;
};

// The active faces of one depth as a view sees them.
class SeenFaces {
 public:
  SeenFaces(const AdaptiveSubdivision& mesh, const Picture& picture, const ViewSubdivisionOptions& options)
      : mesh_(mesh), picture_(picture), options_(options), places_(mesh.points().size()) {
    const std::size_t count = mesh.active_count();
    seen_.resize(count);
    facing_.resize(count);
    if (options.tolerance_px > 0) targets_ = mesh.next_points();
    std::vector<std::uint8_t> placed(places_.size(), 0);
    for (FaceId f = 0; f < count; ++f) {
      for (const VertexId v : mesh.active_face(f)) {
        if (placed[v] != 0) continue;
        placed[v] = 1;
        places_[v] = position(mesh.points()[v]);
      }
      look_at(f);
    }
    find_silhouette();
  }

  bool front(FaceId f) const { return seen_[f] != 0 && facing_[f].front; }
  bool silhouette(FaceId f) const { return seen_[f] != 0 && silhouette_[f] != 0; }

  bool done(FaceId f) const {
    const std::span<const VertexId> face = mesh_.active_face(f);
    double longest_px = 0.0;
    for (std::size_t i = 0; i < face.size(); ++i) {
      longest_px = std::max(longest_px, picture_.distance_px(places_[face[i]], places_[face[(i + 1) % face.size()]]));
    }
    return longest_px <= options_.size_px || (options_.tolerance_px > 0 && left_px(f) < options_.tolerance_px);
  }

 private:
  void look_at(FaceId f) {
    const std::span<const VertexId> face = mesh_.active_face(f);
    unsigned beyond = ~0U;
    bool any_normal = false;
    const glm::dvec3 newell = face.size() > 3 ? newell_normal(face) : glm::dvec3(0.0);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const glm::dvec3& here = places_[face[i]];
      beyond &= picture_.beyond(here);
      const glm::dvec3& before = places_[face[(i + face.size() - 1) % face.size()]];
      const glm::dvec3& after = places_[face[(i + 1) % face.size()]];
      const glm::dvec3 normal = glm::cross(here - before, after - here);
      const double turned = glm::dot(normal, newell) < 0 ? -1.0 : 1.0;
      const double side = turned * glm::dot(normal, picture_.eye() - here);
      any_normal |= side != 0;
      facing_[f].front |= side > 0;
      facing_[f].back |= side < 0;
    }
    // Edge-on and without area: either side may turn out to be seen.
    if (!any_normal) facing_[f] = {true, true};
    seen_[f] = beyond == 0;
  }

  glm::dvec3 newell_normal(std::span<const VertexId> face) const {
    glm::dvec3 sum(0.0);
    const glm::dvec3& origin = places_[face[0]];
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      sum += glm::cross(places_[face[i]] - origin, places_[face[i + 1]] - origin);
    }
    return sum;
  }

  void find_silhouette() {
    std::vector<std::uint8_t> on_silhouette(places_.size(), 0);
    silhouette_.assign(mesh_.active_count(), 0);
    for (FaceId f = 0; f < mesh_.active_count(); ++f) {
      const std::span<const VertexId> face = mesh_.active_face(f);
      for (std::size_t k = 0; k < face.size(); ++k) {
        const FaceId g = mesh_.active_neighbor(f, k);
        const bool turns =
            g != kNoFace && ((facing_[f].front && facing_[g].back) || (facing_[f].back && facing_[g].front));
        if (!turns && !mesh_.at_boundary(f, k)) continue;
        on_silhouette[face[k]] = 1;
        on_silhouette[face[(k + 1) % face.size()]] = 1;
      }
    }
    for (unsigned ring = 0;; ++ring) {
      for (FaceId f = 0; f < mesh_.active_count(); ++f) {
        for (const VertexId v : mesh_.active_face(f)) silhouette_[f] |= on_silhouette[v];
      }
      if (ring >= options_.silhouette_rings) return;
      for (FaceId f = 0; f < mesh_.active_count(); ++f) {
        if (silhouette_[f] == 0) continue;
        for (const VertexId v : mesh_.active_face(f)) on_silhouette[v] = 1;
      }
    }
  }

  // How far the face is off the limit surface, about: each full step makes a quarter of the move before it.
  double left_px(FaceId f) const {
    const std::span<const VertexId> face = mesh_.active_face(f);
    double move_px = 0.0;
    if (mesh_.next_is_odd()) {
      for (const VertexId v : face)
        move_px = std::max(move_px, picture_.distance_px(places_[v], position(targets_[v])));
    } else {
      glm::dvec3 middle(0.0);
      for (const VertexId v : face) middle += places_[v] / static_cast<double>(face.size());
      move_px = picture_.distance_px(middle, position(mesh_.edge_point(f)));
    }
    return move_px * 4.0 / 3.0;
  }

  const AdaptiveSubdivision& mesh_;
  const Picture& picture_;
  const ViewSubdivisionOptions& options_;
  std::vector<glm::dvec3> places_;
  std::vector<glm::dvec4> targets_;
  std::vector<std::uint8_t> seen_;
  std::vector<Facing> facing_;
  std::vector<std::uint8_t> silhouette_;
};

Result<void> check_arguments(const PolygonMesh& mesh, const View& view, const ViewSubdivisionOptions& options,
                             std::span<const std::uint8_t> eligible) {
  if (auto checked = check_view(view); !checked) return checked;
  if (options.front_depth > kMaxViewDepth || options.silhouette_depth > kMaxViewDepth) {
    return fail(ErrorKind::usage, fmt::format("depths {} and {}: {} is the most", options.front_depth,
                                              options.silhouette_depth, kMaxViewDepth));
  }
  if (!(options.size_px >= 0) || !(options.tolerance_px >= 0)) {
    return fail(ErrorKind::usage, "the size and the tolerance in pixels must be 0 or more");
  }
  if (!eligible.empty() && eligible.size() != mesh.face_count()) {
    return fail(ErrorKind::usage, fmt::format("{} marks for {} faces", eligible.size(), mesh.face_count()));
  }
  return {};
}

// What one half-step refines, with the support for what may be wanted after it.
std::vector<std::uint8_t> choose(const AdaptiveSubdivision& mesh, const SeenFaces& faces,
                                 const ViewSubdivisionOptions& options, std::span<const std::uint8_t> eligible) {
  const unsigned depth = mesh.depth();
  const unsigned next_full_depth = depth + (mesh.next_is_odd() ? 2 : 1);
  std::vector<std::uint8_t> chosen(mesh.active_count(), 0);
  std::vector<std::uint8_t> once_more(mesh.active_count(), 0);
  std::vector<std::uint8_t> twice_more(mesh.active_count(), 0);
  const auto allowed = [&](FaceId f) { return depth > 0 || eligible.empty() || eligible[f] != 0; };
  for (FaceId f = 0; f < mesh.active_count(); ++f) {
    unsigned limit = faces.front(f) ? options.front_depth : 0;
    if (faces.silhouette(f)) limit = std::max(limit, options.silhouette_depth);
    if (depth >= limit || !allowed(f) || !mesh.refinable(f) || faces.done(f)) continue;
    chosen[f] = 1;
    once_more[f] = next_full_depth < limit ? 1 : 0;
    twice_more[f] = next_full_depth + 2 < limit ? 1 : 0;
  }
  mesh.add_support(once_more, 1);
  mesh.add_support(twice_more, 2);
  for (FaceId f = 0; f < mesh.active_count(); ++f) {
    if ((once_more[f] | twice_more[f]) != 0 && allowed(f)) chosen[f] = 1;
  }
  return chosen;
}

}  // namespace

Result<ViewSubdivision> subdivide_for_view(const PolygonMesh& mesh, const View& view,
                                           const ViewSubdivisionOptions& options,
                                           std::span<const std::uint8_t> eligible) {
  if (auto checked = check_arguments(mesh, view, options, eligible); !checked) {
    return tl::unexpected(checked.error());
  }
  Result<AdaptiveSubdivision> refined = AdaptiveSubdivision::create(mesh, options.subdivision);
  if (!refined) return tl::unexpected(refined.error());
  const Picture picture(view);
  ViewSubdivision result;
  for (unsigned depth = 0; depth < std::max(options.front_depth, options.silhouette_depth); ++depth) {
    if (options.stop && options.stop(depth)) return fail(ErrorKind::interrupted, "the subdivision was stopped");
    const SeenFaces faces(*refined, picture, options);
    if (depth == 0) {
      for (FaceId f = 0; f < mesh.face_count(); ++f) {
        result.front_faces += faces.front(f) ? 1 : 0;
        result.silhouette_faces += faces.silhouette(f) ? 1 : 0;
      }
    }
    const std::vector<std::uint8_t> chosen = choose(*refined, faces, options, eligible);
    if (std::find(chosen.begin(), chosen.end(), 1) == chosen.end()) break;
    if (auto done = refined->refine(chosen); !done) return tl::unexpected(done.error());
  }
  result.refined = std::move(*refined).result();
  return result;
}

}  // namespace fanstream
