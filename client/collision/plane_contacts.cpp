#include "client/collision/plane_contacts.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

#include "client/collision/focus_boxes.h"

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
    const std::uint8_t* const side = sides_.data();
    const std::size_t count = patch.triangles.size();
    std::uint64_t behind = 0;
    for (std::size_t t = 0; t < count; ++t) {
      const auto& [a, b, c] = patch.triangles[t];
      const auto sides = static_cast<std::uint8_t>(side[a] | side[b] | side[c]);
      behind += sides == kBehind ? 1 : 0;
      if (sides == (kBehind | kBefore)) add(patch, t);
    }
    found_.behind += behind;
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
    double* const distance = distances_.data();
    std::uint8_t* const side = sides_.data();
    const TwoDoubles nx{plane_.normal.x, plane_.normal.x};
    const TwoDoubles ny{plane_.normal.y, plane_.normal.y};
    const TwoDoubles nz{plane_.normal.z, plane_.normal.z};
    const TwoDoubles offset{plane_.offset, plane_.offset};
    std::size_t v = 0;
    for (; v + 2 <= count; v += 2) {
      const TwoDoubles d = nx * load(x + v) + ny * load(y + v) + nz * load(z + v) + offset;
      distance[v] = d[0];
      distance[v + 1] = d[1];
      side[v] = side_of(d[0]);
      side[v + 1] = side_of(d[1]);
    }
    for (; v < count; ++v) {
      distance[v] = plane_.distance(patch.position(static_cast<std::uint32_t>(v)));
      side[v] = side_of(distance[v]);
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
    ++found_.touching_original;
    if (found_.contacts.size() >= query_.most_listed) return;
    const auto& t = patch.triangles[triangle];
    found_.contacts.push_back({patch.corners(triangle), {distances_[t[0]], distances_[t[1]], distances_[t[2]]}, true});
  }

  const Plane& plane_;
  PlaneContacts& found_;
  const PlaneQuery& query_;
  std::vector<double>& distances_ = found_.scratch.distances;
  std::vector<std::uint8_t>& sides_ = found_.scratch.sides;
};

// A plane in single precision, among boxes: scaled so that distances within the model are about 1 or less.
struct RoundedPlane {
  std::array<Float4, 3> normal{};
  Float4 offset{};
  // What a distance computed from rounded points may be off. Where the plane is so far from the model, in proportion,
  // that nothing can be said, no point is on either side for certain.
  float slack = 1.0F;
  double unit = 1.0;  // of the distances

  RoundedPlane(const Plane& plane, const BoxFrame& frame) {
    double reach = 0.0;                         // of the model, along the normal
    double magnitude = std::abs(plane.offset);  // which Plane::distance is rounded by
    for (int axis = 0; axis < 3; ++axis) {
      reach += std::abs(plane.normal[axis]) * frame.step * frame.extent;
      magnitude += std::abs(plane.normal[axis]) * (std::abs(frame.origin[axis]) + frame.step * frame.extent);
    }
    const double at_origin = plane.distance(frame.origin) / reach;
    if (!(std::abs(at_origin) < 1e15) || !std::isfinite(magnitude / reach)) return;
    unit = reach;
    offset = float4(static_cast<float>(at_origin));
    const double off = frame.padding / frame.extent + 1e-6 * (1.0 + std::abs(at_origin)) + 4e-15 * (magnitude / reach);
    slack = static_cast<float>(std::min(off, 1e30));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      normal[axis] = float4(static_cast<float>(plane.normal[static_cast<int>(axis)] * frame.step / reach));
    }
  }
  Float4 distances(Float4 x, Float4 y, Float4 z) const {
    return normal[0] * x + normal[1] * y + normal[2] * z + offset;
  }
  // What rounded distances are up to, of points that may be nearer than this, or more behind the plane.
  float below(double distance) const { return static_cast<float>(std::clamp(distance / unit, -1e30, 1e30)) + slack; }
};

// The lanes that a mask of four names, and how many.
struct NamedLanes {
  std::array<std::uint8_t, 4> lanes{};
  std::uint32_t count = 0;
};
constexpr std::array<NamedLanes, 16> named_lanes() {
  std::array<NamedLanes, 16> table;
  for (std::size_t mask = 0; mask < table.size(); ++mask) {
    for (std::uint8_t k = 0; k < 4; ++k) {
      if (((mask >> k) & 1U) != 0) table[mask].lanes[table[mask].count++] = k;
    }
  }
  return table;
}
constexpr std::array<NamedLanes, 16> kNamedLanes = named_lanes();

// A list that grows by what a mask of four lanes names, without a branch for each.
class FourfoldList {
 public:
  explicit FourfoldList(std::vector<std::uint32_t>& values)
      : values_(values), data_(values.data()), capacity_(values.size()) {}
  std::size_t size() const { return size_; }
  std::uint32_t operator[](std::size_t i) const { return data_[i]; }
  template <class Value>
  void add(std::uint32_t mask, const Value& value) {
    if (capacity_ < size_ + 4) [[unlikely]]
      grow();
    std::uint32_t* const end = data_ + size_;
    const NamedLanes& named = kNamedLanes[mask];
    end[0] = value(named.lanes[0]);
    end[1] = value(named.lanes[1]);
    end[2] = value(named.lanes[2]);
    end[3] = value(named.lanes[3]);
    size_ += named.count;
  }

 private:
  [[gnu::noinline]] void grow() {
    values_.resize(2 * size_ + 64);
    data_ = values_.data();
    capacity_ = values_.size();
  }

  std::vector<std::uint32_t>& values_;
  std::uint32_t* data_;
  std::size_t capacity_;
  std::size_t size_ = 0;
};

// Goes down the tree, level by level, then through the triangles of what the plane may cut, then through those that it
// may cut: three loops that hardly branch, and in which one turn does not wait for the one before. Parts before the
// plane, and parts behind it, are left for the search for the least distance.
class PlaneSearch {
 public:
  PlaneSearch(const LiveSurface& surface, const Plane& plane, PlaneContacts& found, const PlaneQuery& query)
      : surface_(surface), plane_(plane), rounded_(plane, surface.frame()), found_(found), query_(query) {
    if (query.within != nullptr) focus_.emplace(*query.within, surface.frame());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      nearer_[axis] = rounded_.normal[axis][0] >= 0.0F ? axis : 3 + axis;
      farther_[axis] = 3 + 2 * axis - nearer_[axis];
    }
  }

  void run() {
    left_.clear();
    open_.add(1, [](std::size_t) { return CellHierarchy::root(); });
    for (std::size_t i = 0; i < open_.size(); ++i) enter(surface_.node(open_[i]));
    for (std::size_t i = 0; i < blocks_.size(); ++i) scan(blocks_[i]);
    for (std::size_t i = 0; i < triangles_.size(); ++i) look_at(surface_.block(triangles_[i] / 4), triangles_[i] % 4);
    const Uint4 behind = behind_;
    found_.behind += std::uint64_t{behind[0]} + behind[1] + behind[2] + behind[3];
    if (query_.least_distance) search_left();
  }

 private:
  using Left = PlaneContacts::Scratch::Left;
  using Node = LiveSurface::Node;
  using Block = LiveSurface::Block;
  static bool later(const Left& a, const Left& b) { return a.least > b.least; }

  // Nearest first.
  void search_left() {
    std::erase_if(left_, [most = rounded_.below(found_.least_distance)](const Left& l) { return l.least > most; });
    std::make_heap(left_.begin(), left_.end(), later);
    while (!left_.empty()) {
      std::pop_heap(left_.begin(), left_.end(), later);
      const Left next = left_.back();
      left_.pop_back();
      if (next.least > rounded_.below(found_.least_distance)) break;
      go_on(next.below);
    }
  }

  Float4 at_ends(const FourBoxes& boxes, const std::array<std::size_t, 3>& ends) const {
    return rounded_.distances(boxes.ends[ends[0]], boxes.ends[ends[1]], boxes.ends[ends[2]]);
  }

  void enter(const Node& node) {
    const Float4 least = at_ends(node.boxes, nearer_);
    const Uint4 triangles = load4(node.triangles.data());
    const Uint4 filled = mask_of(triangles != uint4(0));
    const Uint4 before = mask_of(least > float4(rounded_.slack));
    const Uint4 behind = mask_of(at_ends(node.boxes, farther_) < float4(-rounded_.slack));
    if (focus_) return enter_in_focus(node, least, lane_bits(before));
    behind_ += behind & triangles;
    const std::uint32_t cut = lane_bits(filled & ~(before | behind));
    const std::uint32_t leaves = node.leaves();
    if ((cut & ~leaves) != 0) open_.add(cut & ~leaves, [&](std::size_t k) { return node.below[k]; });
    if ((cut & leaves) != 0) blocks_.add(cut & leaves, [&](std::size_t k) { return node.below[k] & ~Node::kLeaf; });
    if (query_.least_distance) leave(node, lane_bits(filled) & ~cut, least);
  }

  // What is behind is in focus in part only, perhaps: it has to be looked at, too.
  void enter_in_focus(const Node& node, Float4 least, std::uint32_t before) {
    const std::uint32_t touched = focus_->touched(node.boxes);
    const std::uint32_t leaves = node.leaves();
    const std::uint32_t wanted = touched & ~before;
    open_.add(wanted & ~leaves, [&](std::size_t k) { return node.below[k]; });
    blocks_.add(wanted & leaves, [&](std::size_t k) { return node.below[k] & ~Node::kLeaf; });
    if (query_.least_distance) leave(node, touched & before, least);
  }

  void leave(const Node& node, std::uint32_t lanes, Float4 least) {
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(lanes));
      left_.push_back({least[k], node.below[k]});
    }
  }

  void scan(std::uint32_t number) {
    const Block& block = surface_.block(number);
    const auto& [p, q, r] = block.rounded;
    const Float4 a = rounded_.distances(p[0], p[1], p[2]);
    const Float4 b = rounded_.distances(q[0], q[1], q[2]);
    const Float4 c = rounded_.distances(r[0], r[1], r[2]);
    const Float4 low = lower(lower(a, b), c);
    const Float4 high = upper(upper(a, b), c);
    const Uint4 behind = mask_of(high < float4(-rounded_.slack));
    const Uint4 not_before = mask_of(low <= float4(rounded_.slack));
    if (!focus_) behind_ -= behind;  // a mask is -1
    const Uint4 cut = focus_ ? not_before : not_before & ~behind;
    found_.tested_triangles += block.count;
    if (block.next != Block::kNone) blocks_.add(1, [&](std::size_t) { return block.next; });
    if (lane_bits(cut) != 0)
      triangles_.add(lane_bits(cut), [&](std::size_t k) { return static_cast<std::uint32_t>(4 * number + k); });
    if (!query_.least_distance) return;
    std::uint32_t lanes = lane_bits(~cut & mask_of(low <= float4(rounded_.below(found_.least_distance))));
    for (; lanes != 0; lanes &= lanes - 1) note_least(block, static_cast<std::size_t>(std::countr_zero(lanes)));
  }

  std::array<double, 3> distances(const Block& block, std::size_t k) const {
    const auto& corners = block.corners[k];
    return {plane_.distance(corners[0]), plane_.distance(corners[1]), plane_.distance(corners[2])};
  }

  bool counts(const Block& block, std::size_t k) const { return !focus_ || query_.within->holds(block.corners[k]); }

  void look_at(const Block& block, std::size_t k) {
    if (!counts(block, k)) return;
    const std::array<double, 3> d = distances(block, k);
    if (query_.least_distance) note_least(block, k, d);
    const auto sides = static_cast<std::uint8_t>(side_of(d[0]) | side_of(d[1]) | side_of(d[2]));
    if (sides != (kBehind | kBefore)) {
      found_.behind += sides == kBehind ? 1 : 0;
      return;
    }
    const bool original = block.is_original(k);
    ++found_.touching;
    found_.touching_original += original ? 1 : 0;
    if (found_.contacts.size() >= query_.most_listed) return;
    PlaneContact& contact = found_.contacts.emplace_back();
    contact.corners = block.corners[k];
    contact.distances = d;
    contact.original = original;
  }

  void note_least(const Block& block, std::size_t k) {
    if (counts(block, k)) note_least(block, k, distances(block, k));
  }
  void note_least(const Block& block, std::size_t k, const std::array<double, 3>& d) {
    for (std::size_t c = 0; c < 3; ++c) {
      if (d[c] >= found_.least_distance) continue;
      found_.least_distance = d[c];
      found_.least_at = block.corners[k][c];
    }
  }

  void go_on(std::uint32_t below) {
    if ((below & Node::kLeaf) == 0) {
      const Node& node = surface_.node(below);
      const Float4 least = at_ends(node.boxes, nearer_);
      const std::uint32_t touched = focus_ ? focus_->touched(node.boxes) : lane_bits(node.boxes.filled());
      const std::uint32_t near = lane_bits(mask_of(least <= float4(rounded_.below(found_.least_distance))));
      for (std::uint32_t lanes = touched & near; lanes != 0; lanes &= lanes - 1) {
        const auto k = static_cast<std::size_t>(std::countr_zero(lanes));
        left_.push_back({least[k], node.below[k]});
        std::push_heap(left_.begin(), left_.end(), later);
      }
      return;
    }
    for (std::uint32_t b = below & ~Node::kLeaf; b != Block::kNone; b = surface_.block(b).next) {
      const Block& block = surface_.block(b);
      for (std::size_t k = 0; k < block.count; ++k) note_least(block, k);
    }
  }

  const LiveSurface& surface_;
  const Plane& plane_;
  RoundedPlane rounded_;
  std::optional<FocusBoxes> focus_;
  std::array<std::size_t, 3> nearer_{}, farther_{};  // of FourBoxes::ends
  Uint4 behind_{};                                   // triangles, summed by lane
  PlaneContacts& found_;
  const PlaneQuery& query_;
  FourfoldList open_{found_.scratch.open};
  FourfoldList blocks_{found_.scratch.blocks};        // of leaves that the plane may cut
  FourfoldList triangles_{found_.scratch.triangles};  // that it may cut: 4 times the block and which of its four
  std::vector<Left>& left_ = found_.scratch.left;     // a heap, the least on top
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
