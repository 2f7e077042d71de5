#include "tests/bench/papers/collision_scene.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <unordered_map>

#include "server/build/asset_builder.h"
#include "tests/bench/level_quality.h"
#include "tests/bench/open_asset.h"
#include "tests/bench/papers/ellipsoid.h"

namespace fanstream::bench {

TriangleMesh ContactFrame::ball() const {
  TriangleMesh mesh = make_octahedral_ellipsoid();
  const double radius = 0.5 * focus.sphere->radius;
  const glm::dvec3 centre = focus.sphere->centre - (radius - focus.sphere->radius / 20.0) * planes[0].normal;
  for (glm::dvec3& p : mesh.positions) p = centre + radius * glm::normalize(p);
  return mesh;
}

Result<std::vector<TriangleMesh>> reduced_meshes(const TriangleMesh& mesh,
                                                 const std::vector<std::uint32_t>& triangles) {
  constexpr int kBits = 20;  // so that the grid takes nothing away
  const PositionGrid grid = PositionGrid::fit(mesh.positions, kBits);
  std::vector<GridPoint> places;
  for (const glm::dvec3& p : mesh.positions) places.push_back(grid.encode(p));
  const MergeHistory history = simplify(mesh, {});
  const CodedHistory coded(history, std::move(places), grid);
  const auto vertex_count = static_cast<std::uint32_t>(mesh.positions.size());
  LevelReplay replay(coded, grid, vertex_count);
  std::vector<TriangleMesh> levels;
  for (const std::uint32_t wanted : triangles) {
    if (wanted >= mesh.triangles.size()) {
      levels.push_back(mesh);
      continue;
    }
    // Each split of a closed surface adds two triangles.
    const std::uint32_t vertices = vertex_count - (static_cast<std::uint32_t>(mesh.triangles.size()) - wanted) / 2;
    if (vertices < replay.vertex_count()) {
      return fail(ErrorKind::bad_input, "the mesh cannot be reduced to " + std::to_string(wanted) + " triangles");
    }
    replay.refine_to(vertices);
    levels.push_back(replay.mesh());
  }
  return levels;
}

Result<CollisionSubject> make_subject(const TriangleMesh& mesh) {
  BuildOptions options;
  options.position_bits = 16;  // of the smallest model too
  options.cell_vertices = 1.0;
  options.slab_growth = 3.0;
  options.segment_splits = 2.0;
  options.edges_per_vertex = 4.0;  // fewer generations: less that has to be restored around a focus
  options.base_vertices = 128;     // whatever the model's size: what is never in focus costs, too
  Result<BuiltAsset> built = build_asset(mesh, options);
  if (!built) return tl::unexpected(built.error());
  Result<std::unique_ptr<ProgressiveMesh>> full = rebuild_fully(built->bytes, "the asset");
  if (!full) return tl::unexpected(full.error());
  CollisionSubject subject;
  subject.full = (*full)->triangle_mesh();
  full->reset();
  subject.flat = patch_of(subject.full);
  subject.diagonal = bounds_of(subject.full.positions).diagonal();
  const Result<std::shared_ptr<const OpenAsset>> asset = OpenAsset::open(std::move(built->bytes), "the asset");
  if (!asset) return tl::unexpected(asset.error());
  for (std::unique_ptr<LocalRestoration>* model : {&subject.local, &subject.refined}) {
    *model = std::make_unique<LocalRestoration>((*asset)->asset_head(), (*asset)->asset_index());
    for (std::uint32_t c = 0; c < (*asset)->cell_count(); ++c) {
      for (std::uint32_t s = 0; s < (*asset)->segment_count(c); ++s) {
        if (auto added = (*model)->add_segment(c, s, (*asset)->segment(c, s)); !added) {
          return tl::unexpected(added.error());
        }
      }
    }
    if (auto measured = (*model)->measure(); !measured) return tl::unexpected(measured.error());
  }
  subject.refined->set_coarseness(0.0);
  subject.refined->move({});
  return subject;
}

namespace {

// A curve of a mesh in a plane, triangle by triangle.
struct Section {
  std::vector<glm::dvec3> points;
  std::vector<glm::dvec3> normals;
  double length = 0.0;
};

class SectionTracer {
 public:
  SectionTracer(const TriangleMesh& mesh, const Plane& plane) : mesh_(mesh) {
    distances_.reserve(mesh.positions.size());
    for (const glm::dvec3& p : mesh.positions) distances_.push_back(plane.distance(p));
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        if (cuts(t, k)) at_edge_[key(t, k)].push_back(t);
      }
    }
  }

  Section longest() {
    std::vector<bool> seen(mesh_.triangles.size(), false);
    Section best;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (seen[t] || !(cuts(t, 0) || cuts(t, 1) || cuts(t, 2))) continue;
      Section section = trace(t, seen);
      if (section.length > best.length) best = std::move(section);
    }
    return best;
  }

 private:
  using EdgeKey = std::uint64_t;
  VertexId from(std::uint32_t t, int k) const { return mesh_.triangles[t][static_cast<std::size_t>(k)]; }
  VertexId to(std::uint32_t t, int k) const { return mesh_.triangles[t][static_cast<std::size_t>((k + 1) % 3)]; }
  EdgeKey key(std::uint32_t t, int k) const {
    const VertexId a = from(t, k);
    const VertexId b = to(t, k);
    return (EdgeKey{std::min(a, b)} << 32U) | std::max(a, b);
  }
  bool cuts(std::uint32_t t, int k) const { return (distances_[from(t, k)] < 0.0) != (distances_[to(t, k)] < 0.0); }

  // Both ways from a triangle to where the curve ends or closes would be more; one way is enough to walk along.
  Section trace(std::uint32_t t, std::vector<bool>& seen) const {
    Section section;
    EdgeKey entered = 0;
    while (!seen[t]) {
      seen[t] = true;
      int out = -1;
      for (int k = 0; k < 3; ++k) {
        if (cuts(t, k) && key(t, k) != entered) out = k;
      }
      if (out < 0) break;
      const glm::dvec3& a = mesh_.positions[from(t, out)];
      const glm::dvec3& b = mesh_.positions[to(t, out)];
      const double share = distances_[from(t, out)] / (distances_[from(t, out)] - distances_[to(t, out)]);
      const glm::dvec3 point = a + share * (b - a);
      if (!section.points.empty()) section.length += glm::distance(section.points.back(), point);
      section.points.push_back(point);
      const Triangle& corners = mesh_.triangles[t];
      const glm::dvec3 normal = glm::cross(mesh_.positions[corners[1]] - mesh_.positions[corners[0]],
                                           mesh_.positions[corners[2]] - mesh_.positions[corners[0]]);
      section.normals.push_back(normal);
      entered = key(t, out);
      const std::vector<std::uint32_t>& both = at_edge_.at(entered);
      if (both.size() < 2) break;
      t = both[0] == t ? both[1] : both[0];
    }
    return section;
  }

  const TriangleMesh& mesh_;
  std::vector<double> distances_;
  std::unordered_map<EdgeKey, std::vector<std::uint32_t>> at_edge_;
};

}  // namespace

namespace {

Result<Section> section_of(const TriangleMesh& mesh) {
  const Bounds box = bounds_of(mesh.positions);
  const glm::dvec3 normal = glm::normalize(glm::dvec3(1.0, 0.11, 0.07));
  const Plane cut{normal, -glm::dot(normal, 0.5 * (box.low + box.high))};
  Section section = SectionTracer(mesh, cut).longest();
  if (section.points.size() < 2) return fail(ErrorKind::bad_input, "no plane through the middle cuts the mesh");
  return section;
}

// Frames along the section from `begin` on, which is a length.
std::vector<ContactFrame> frames_along(const Section& section, const Bounds& box, double radius, double begin,
                                       std::size_t most) {
  // A room that the model stands in; one of its walls leaves for the plane of contact.
  const double gap = 0.01 * box.diagonal();
  const std::array<Plane, 6> walls{Plane{{1, 0, 0}, gap - box.low.x}, {{-1, 0, 0}, gap + box.high.x},
                                   {{0, 1, 0}, gap - box.low.y},      {{0, -1, 0}, gap + box.high.y},
                                   {{0, 0, 1}, gap - box.low.z},      {{0, 0, -1}, gap + box.high.z}};
  std::vector<ContactFrame> frames;
  const double step = radius / 20.0;
  double left = begin;  // of the way to the next frame
  for (std::size_t i = 0; i + 1 < section.points.size() && frames.size() < most; ++i) {
    const glm::dvec3 along = section.points[i + 1] - section.points[i];
    const double length = glm::length(along);
    const double size = glm::length(section.normals[i]);
    if (!(length > 0.0) || !(size > 0.0)) continue;
    for (; left <= length && frames.size() < most; left += step) {
      const glm::dvec3 at = section.points[i] + along * (left / length);
      const glm::dvec3 inward = -section.normals[i] / size;
      ContactFrame frame;
      frame.focus.sphere = FocusSphere{at, radius};
      frame.planes = walls;
      frame.planes[0] = {inward, -glm::dot(inward, at) - radius / 20.0};
      frames.push_back(std::move(frame));
    }
    left -= length;
  }
  return frames;
}

}  // namespace

Result<ContactPath> contact_path(const TriangleMesh& mesh, double radius, std::size_t most) {
  const Result<Section> section = section_of(mesh);
  if (!section) return tl::unexpected(section.error());
  return frames_along(*section, bounds_of(mesh.positions), radius, 0.0, most);
}

Result<std::vector<ContactPath>> contact_stretches(const TriangleMesh& mesh, double radius, std::size_t stretches,
                                                   std::size_t frames_each) {
  const Result<Section> section = section_of(mesh);
  if (!section) return tl::unexpected(section.error());
  std::vector<ContactPath> paths;
  for (std::size_t i = 0; i < stretches; ++i) {
    const double begin = section->length * static_cast<double>(i) / static_cast<double>(stretches);
    paths.push_back(frames_along(*section, bounds_of(mesh.positions), radius, begin, frames_each));
  }
  return paths;
}

}  // namespace fanstream::bench
