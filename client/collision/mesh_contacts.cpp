#include "client/collision/mesh_contacts.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/traversal/collision/intersect.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "common/geometry/closest_point.h"
#include "common/geometry/triangle_tree.h"

namespace fanstream {
namespace {

using Model = fcl::BVHModel<fcl::OBBRSSd>;
using Corners = std::array<glm::dvec3, 3>;

fcl::Vector3d to_fcl(const glm::dvec3& p) { return {p.x, p.y, p.z}; }
glm::dvec3 to_glm(const fcl::Vector3d& p) { return {p[0], p[1], p[2]}; }

bool comes_first(const glm::dvec3& a, const glm::dvec3& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); }

// A triangle is the same whatever corner it starts with, and is to be rounded the same.
Corners turned(Corners c) {
  if (comes_first(c[1], c[0]) && !comes_first(c[2], c[1])) return {c[1], c[2], c[0]};
  if (comes_first(c[2], c[0]) && comes_first(c[2], c[1])) return {c[2], c[0], c[1]};
  return c;
}

std::shared_ptr<Model> model_of(const std::vector<Corners>& triangles) {
  auto model = std::make_shared<Model>();
  model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(3 * triangles.size()));
  for (const Corners& c : triangles) model->addTriangle(to_fcl(c[0]), to_fcl(c[1]), to_fcl(c[2]));
  model->endModel();
  return model;
}

Bounds bounds_of_corners(const Corners& c) {
  return {glm::min(glm::min(c[0], c[1]), c[2]), glm::max(glm::max(c[0], c[1]), c[2])};
}

bool overlap(const Bounds& a, const Bounds& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
         a.low.z <= b.high.z && b.low.z <= a.high.z;
}

}  // namespace

struct MeshObstacle::Data {
  std::vector<Corners> triangles;
  std::shared_ptr<Model> model;
  TriangleTree tree;
  Bounds box = kNoBounds;

  // Whether one of FCL's volumes around the triangles, of which each is a leaf, reaches into the box.
  bool may_touch(const Bounds& box) const;
};

bool MeshObstacle::Data::may_touch(const Bounds& other) const {
  if (!overlap(other, box)) return false;
  fcl::OBBd volume;
  volume.axis.setIdentity();
  volume.To = to_fcl(0.5 * (other.low + other.high));
  volume.extent = to_fcl(0.5 * (other.high - other.low));
  // More than FCL's test of two volumes is rounded by.
  volume.extent.array() += 1e-9 * (volume.extent.maxCoeff() + volume.To.cwiseAbs().maxCoeff());
  std::vector<int> open{0};
  while (!open.empty()) {
    const auto& node = model->getBV(open.back());
    open.pop_back();
    if (!node.bv.obb.overlap(volume)) continue;
    if (node.isLeaf()) return true;
    open.push_back(node.rightChild());
    open.push_back(node.leftChild());
  }
  return false;
}

Result<MeshObstacle> MeshObstacle::create(const TriangleMesh& mesh) {
  Result<TriangleTree> tree = TriangleTree::build(mesh);
  if (!tree) return tl::unexpected(tree.error());
  auto data = std::make_shared<Data>();
  data->tree = std::move(*tree);
  data->triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const Corners corners{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
    for (const glm::dvec3& p : corners) data->box = united(data->box, {p, p});
    data->triangles.push_back(corners);
  }
  data->model = model_of(data->triangles);
  return MeshObstacle(std::move(data));
}

std::size_t MeshObstacle::triangle_count() const { return data_->triangles.size(); }
Bounds MeshObstacle::box() const { return data_->box; }

// Triangles of the model, gathered for one search.
class MeshSearch {
 public:
  explicit MeshSearch(const MeshObstacle& obstacle) : obstacle_(*obstacle.data_) {}

  void add(const Corners& corners, bool original) {
    triangles_.push_back(turned(corners));
    original_.push_back(original);
  }
  void add(const SurfacePatch& patch) {
    for (std::size_t t = 0; t < patch.triangles.size(); ++t) add(patch.corners(t), true);
  }
  void add_near(const LiveSurface& surface) {
    surface.visit([&](const Bounds& box) { return obstacle_.may_touch(box); },
                  [&](const LiveTriangle& t) {
                    if (overlap(bounds_of_corners(t.corners), obstacle_.box)) add(t.corners, t.original);
                  });
  }
  void add_all(const LiveSurface& surface) {
    surface.visit([](const Bounds&) { return true; }, [&](const LiveTriangle& t) { add(t.corners, t.original); });
  }

  MeshContacts contacts(std::uint64_t most_listed) const {
    MeshContacts found;
    found.tested_triangles = triangles_.size();
    if (triangles_.empty()) return found;
    // Contact points are left out here: where FCL finds none for a pair, it would leave out the pair.
    fcl::CollisionRequestd request(kMostPairs + 1, false);
    fcl::CollisionResultd result;
    const auto here = fcl::Transform3d::Identity();
    fcl::collide(model_of(triangles_).get(), here, obstacle_.model.get(), here, request, result);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const fcl::Contactd& c = result.getContact(i);
      pairs.emplace_back(static_cast<std::uint32_t>(c.b1), static_cast<std::uint32_t>(c.b2));
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    found.all_found = pairs.size() <= kMostPairs;
    pairs.resize(std::min<std::size_t>(pairs.size(), kMostPairs));
    found.touching_pairs = pairs.size();
    for (const auto& [mine, other] : pairs) found.original_pairs += original_[mine] ? 1 : 0;
    pairs.resize(std::min<std::uint64_t>(pairs.size(), most_listed));
    for (const auto& [mine, other] : pairs) found.contacts.push_back(contact(mine, other));
    return found;
  }

  Separation distance() const {
    fcl::DistanceRequestd request(true);
    fcl::DistanceResultd result;
    const auto here = fcl::Transform3d::Identity();
    fcl::distance(model_of(triangles_).get(), here, obstacle_.model.get(), here, request, result);
    return {std::max(0.0, result.min_distance), to_glm(result.nearest_points[0]), to_glm(result.nearest_points[1])};
  }

 private:
  MeshContact contact(std::uint32_t mine, std::uint32_t other) const {
    const Corners& a = triangles_[mine];
    const Corners& b = obstacle_.triangles[other];
    MeshContact contact{a, other, original_[mine]};
    fcl::Vector3d points[2];
    unsigned int count = 0;
    double depth = 0.0;
    fcl::Vector3d normal = fcl::Vector3d::Zero();
    fcl::detail::Intersectd::intersect_Triangle(to_fcl(a[0]), to_fcl(a[1]), to_fcl(a[2]), to_fcl(b[0]), to_fcl(b[1]),
                                                to_fcl(b[2]), points, &count, &depth, &normal);
    if (count == 0) {
      const glm::dvec3 middle = (a[0] + a[1] + a[2]) / 3.0;
      contact.position = closest_point_on_triangle(middle, b[0], b[1], b[2]);
      return contact;
    }
    contact.position = to_glm(count == 1 ? points[0] : fcl::Vector3d(0.5 * (points[0] + points[1])));
    contact.normal = to_glm(normal);
    contact.depth = std::max(0.0, depth);
    return contact;
  }

  const MeshObstacle::Data& obstacle_;
  std::vector<Corners> triangles_;
  std::vector<bool> original_;
};

MeshContacts find_contacts(const LiveSurface& surface, const MeshObstacle& obstacle, std::uint64_t most_listed) {
  MeshSearch search(obstacle);
  search.add_near(surface);
  return search.contacts(most_listed);
}

MeshContacts find_contacts(const SurfacePatch& patch, const MeshObstacle& obstacle, std::uint64_t most_listed) {
  MeshSearch search(obstacle);
  search.add(patch);
  return search.contacts(most_listed);
}

Separation distance_between(const LiveSurface& surface, const MeshObstacle& obstacle) {
  MeshSearch search(obstacle);
  search.add_all(surface);
  return search.distance();
}

std::function<bool(const Bounds&)> region_of(const MeshObstacle& obstacle) {
  return [data = obstacle.data_](const Bounds& box) {
    if (!overlap(box, data->box)) return false;
    const glm::dvec3 middle = 0.5 * (box.low + box.high);
    const double reach = 0.5 * glm::distance(box.low, box.high) * (1.0 + 1e-9) + 1e-12 * glm::length(middle);
    return data->tree.closest(middle).squared_distance <= reach * reach;
  };
}

}  // namespace fanstream
