#include "client/collision/plane_contacts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace fanstream {
namespace {

// The least and the largest distance of any point of a box, a little wider than it is.
struct Reach {
  double least = 0.0;
  double largest = 0.0;
};

Reach reach(const Plane& plane, const Bounds& box) {
  const glm::dvec3& n = plane.normal;
  const double x0 = n.x * box.low.x;
  const double x1 = n.x * box.high.x;
  const double y0 = n.y * box.low.y;
  const double y1 = n.y * box.high.y;
  const double z0 = n.z * box.low.z;
  const double z1 = n.z * box.high.z;
  const double least = std::min(x0, x1) + std::min(y0, y1) + std::min(z0, z1) + plane.offset;
  const double largest = std::max(x0, x1) + std::max(y0, y1) + std::max(z0, z1) + plane.offset;
  const double sizes = std::max(std::abs(x0), std::abs(x1)) + std::max(std::abs(y0), std::abs(y1)) +
                       std::max(std::abs(z0), std::abs(z1)) + std::abs(plane.offset);
  const double slack = 1e-15 * sizes;
  return {least - slack, largest + slack};
}

// Vectors of GCC and clang, on any target. The operations are those of Plane::distance, in its order.
using TwoDoubles = double __attribute__((vector_size(16)));
using TwoLongs = long long __attribute__((vector_size(16)));

TwoDoubles load(const double* p) { return TwoDoubles{p[0], p[1]}; }

// Bit 0: on or behind the plane; bit 1: on it or before it.
constexpr std::uint8_t kBehind = 1;
constexpr std::uint8_t kBefore = 2;
std::uint8_t side_of(double distance) {
  return static_cast<std::uint8_t>((distance <= 0.0 ? kBehind : 0) | (distance >= 0.0 ? kBefore : 0));
}

class PlaneScan {
 public:
  PlaneScan(const Plane& plane, PlaneContacts& found, const PlaneQuery& query)
      : plane_(plane), found_(found), query_(query) {}

  void scan(const SurfacePatch& patch) {
    measure(patch);
    if (query_.least_distance) note_least(patch);
    found_.tested_triangles += patch.triangles.size();
    std::uint64_t behind = 0;
    for (std::size_t t = 0; t < patch.triangles.size(); ++t) {
      const auto& [a, b, c] = patch.triangles[t];
      const auto sides = static_cast<std::uint8_t>(sides_[a] | sides_[b] | sides_[c]);
      behind += sides == kBehind ? 1 : 0;
      if (sides == (kBehind | kBefore)) add(patch, t);
    }
    found_.behind += behind;
  }

  // Only for the least distance.
  void measure_least(const SurfacePatch& patch) {
    measure(patch);
    note_least(patch);
  }

 private:
  void measure(const SurfacePatch& patch) {
    const std::size_t count = patch.vertex_count();
    if (distances_.size() < count) {
      distances_.resize(count);
      sides_.resize(count);
    }
    const double* const x = patch.x.data();
    const double* const y = patch.y.data();
    const double* const z = patch.z.data();
    const TwoDoubles nx{plane_.normal.x, plane_.normal.x};
    const TwoDoubles ny{plane_.normal.y, plane_.normal.y};
    const TwoDoubles nz{plane_.normal.z, plane_.normal.z};
    const TwoDoubles offset{plane_.offset, plane_.offset};
    std::size_t v = 0;
    for (; v + 2 <= count; v += 2) {
      const TwoDoubles d = nx * load(x + v) + ny * load(y + v) + nz * load(z + v) + offset;
      distances_[v] = d[0];
      distances_[v + 1] = d[1];
      sides_[v] = side_of(d[0]);
      sides_[v + 1] = side_of(d[1]);
    }
    for (; v < count; ++v) {
      distances_[v] = plane_.distance(patch.position(static_cast<std::uint32_t>(v)));
      sides_[v] = side_of(distances_[v]);
    }
  }

  void note_least(const SurfacePatch& patch) {
    double least = found_.least_distance;
    std::size_t at = patch.vertex_count();
    for (std::size_t v = 0; v < patch.vertex_count(); ++v) {
      if (distances_[v] >= least) continue;
      least = distances_[v];
      at = v;
    }
    if (at == patch.vertex_count()) return;
    found_.least_distance = least;
    found_.least_at = patch.position(static_cast<std::uint32_t>(at));
  }

  void add(const SurfacePatch& patch, std::size_t triangle) {
    ++found_.touching;
    found_.touching_original += patch.is_original(triangle) ? 1 : 0;
    if (found_.contacts.size() >= query_.most_listed) return;
    const auto& t = patch.triangles[triangle];
    found_.contacts.push_back(
        {patch.corners(triangle), {distances_[t[0]], distances_[t[1]], distances_[t[2]]}, patch.is_original(triangle)});
  }

  const Plane& plane_;
  PlaneContacts& found_;
  const PlaneQuery& query_;
  std::vector<double>& distances_ = found_.scratch.distances;
  std::vector<std::uint8_t>& sides_ = found_.scratch.sides;
};

// Goes down the tree: parts before the plane, and parts behind it, are left for the search for the least distance.
class PlaneSearch {
 public:
  PlaneSearch(const LiveSurface& surface, const Plane& plane, PlaneContacts& found, const PlaneQuery& query)
      : surface_(surface), plane_(plane), found_(found), query_(query), scan_(plane, found, query) {
    left_.clear();
  }

  void run() {
    if (!surface_.has_tree()) {
      surface_.visit([](const LiveSurface::Part&) { return true; },
                     [&](std::uint32_t, const SurfacePatch& patch) { scan_.scan(patch); });
      return;
    }
    enter(CellHierarchy::root());
    while (!left_.empty()) {
      std::pop_heap(left_.begin(), left_.end(), later);
      const Left next = left_.back();
      left_.pop_back();
      if (next.least >= found_.least_distance) break;
      go_on(next.node);
    }
  }

 private:
  using Left = PlaneContacts::Scratch::Left;
  static bool later(const Left& a, const Left& b) { return a.least > b.least; }

  void enter(std::uint32_t n) {
    const LiveSurface::Part& part = surface_.part(n);
    if (part.triangles == 0) return;
    const Reach r = reach(plane_, part.box);
    if (r.least > 0.0 || r.largest < 0.0) {
      if (r.largest < 0.0) found_.behind += part.triangles;
      leave(n, r.least);
      return;
    }
    const CellHierarchy::Node& node = surface_.cells().node(n);
    if (node.cell != CellHierarchy::kNone && !surface_.patch(node.cell).triangles.empty()) {
      scan_.scan(surface_.patch(node.cell));
      return;
    }
    for (const std::uint32_t below : node.below) {
      if (below != CellHierarchy::kNone) enter(below);
    }
  }

  void leave(std::uint32_t n, double least) {
    if (!query_.least_distance || least >= found_.least_distance) return;
    left_.push_back({least, n});
    std::push_heap(left_.begin(), left_.end(), later);
  }

  void go_on(std::uint32_t n) {
    const CellHierarchy::Node& node = surface_.cells().node(n);
    if (node.cell != CellHierarchy::kNone && !surface_.patch(node.cell).triangles.empty()) {
      scan_.measure_least(surface_.patch(node.cell));
      return;
    }
    for (const std::uint32_t below : node.below) {
      if (below == CellHierarchy::kNone || surface_.part(below).triangles == 0) continue;
      leave(below, reach(plane_, surface_.part(below).box).least);
    }
  }

  const LiveSurface& surface_;
  const Plane& plane_;
  PlaneContacts& found_;
  const PlaneQuery& query_;
  PlaneScan scan_;
  std::vector<Left>& left_ = found_.scratch.left;  // a heap, the least on top
};

}  // namespace

Result<Plane> make_plane(double a, double b, double c, double d) {
  if (!std::isfinite(a) || !std::isfinite(b) || !std::isfinite(c) || !std::isfinite(d)) {
    return fail(ErrorKind::usage, "the plane's numbers are not finite");
  }
  const double largest = std::max({std::abs(a), std::abs(b), std::abs(c)});
  if (largest == 0.0) return fail(ErrorKind::usage, "the plane's normal a,b,c is zero");
  const glm::dvec3 scaled(a / largest, b / largest, c / largest);
  const double length = glm::length(scaled);
  const double offset = d / largest / length;
  if (!std::isfinite(offset)) return fail(ErrorKind::usage, "the plane's normal a,b,c is zero beside its d");
  return Plane{scaled / length, offset};
}

double PlaneContact::depth() const { return std::max(0.0, -std::min({distances[0], distances[1], distances[2]})); }

void PlaneContacts::clear() {
  contacts.clear();
  touching = touching_original = behind = tested_triangles = 0;
  least_distance = std::numeric_limits<double>::infinity();
  least_at = glm::dvec3(0.0);
}

void find_contacts(const LiveSurface& surface, const Plane& plane, PlaneContacts& found, const PlaneQuery& query) {
  PlaneSearch(surface, plane, found, query).run();
}

void find_contacts(const SurfacePatch& patch, const Plane& plane, PlaneContacts& found, const PlaneQuery& query) {
  PlaneScan(plane, found, query).scan(patch);
}

std::function<bool(const Bounds&)> region_of(std::vector<Plane> planes) {
  return [planes = std::move(planes)](const Bounds& box) {
    return std::any_of(planes.begin(), planes.end(), [&](const Plane& plane) {
      const Reach r = reach(plane, box);
      return r.least <= 0.0 && r.largest >= 0.0;
    });
  };
}

}  // namespace fanstream
