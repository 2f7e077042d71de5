#include "common/geometry/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <string>

#include "common/geometry/closest_point.h"

namespace fanstream {

namespace {

constexpr double kLargestCoordinate = 1e70;
constexpr std::uint32_t kLeafTriangles = 4;
constexpr int kBins = 16;
// Below this depth of binary splits ranges are halved, so that the depth is at most 40 + 31. A query leaves at most
// three children of each node on its stack.
constexpr int kHeuristicDepth = 40;
constexpr std::size_t kStackSize = 3 * (kHeuristicDepth + 31) + 4;
// Rounding a query to floats, and box distances computed in floats, can go wrong by this much of the root box.
constexpr float kBoxPadding = 4e-7F;
constexpr double kFarthest = 1e18;  // in units of the root box; its square fits a float

struct FloatBox {
  std::array<float, 3> low{INFINITY, INFINITY, INFINITY};
  std::array<float, 3> high{-INFINITY, -INFINITY, -INFINITY};

  void include(const FloatBox& other) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], other.low[axis]);
      high[axis] = std::max(high[axis], other.high[axis]);
    }
  }
  float half_area() const {
    const float x = high[0] - low[0];
    const float y = high[1] - low[1];
    const float z = high[2] - low[2];
    return x < 0.0F ? 0.0F : x * y + y * z + z * x;
  }
};

struct Primitive {
  FloatBox box;
  std::uint32_t triangle = 0;
  float middle(std::size_t axis) const { return box.low[axis] + box.high[axis]; }  // twice the centre
};

struct Range {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
  int depth = 0;
  FloatBox box;
  std::uint32_t size() const { return end - begin; }
};

struct Split {
  std::size_t axis = 0;
  float low = 0.0F;
  float bins_per_unit = 0.0F;
  int first_right_bin = 0;  // 0: none found
  int bin(const Primitive& primitive) const {
    return std::min(kBins - 1, static_cast<int>((primitive.middle(axis) - low) * bins_per_unit));
  }
};

using Lanes = double __attribute__((vector_size(16)));

// A vector in each lane.
struct Vector3 {
  Lanes x, y, z;
};
inline Vector3 operator-(const Vector3& a, const Vector3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Lanes dot(const Vector3& a, const Vector3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// From a point to an edge; both are seen from the edge's first end.
inline Lanes squared_to_edge(const Vector3& point, const Vector3& edge, const Lanes& squared_length) {
  const Lanes along = dot(point, edge);
  const Lanes part = along / squared_length;  // not a number on an edge without length: then the first end
  const Lanes from_first = part > 0.0 ? part : Lanes{};
  const Lanes clamped = from_first < 1.0 ? from_first : Lanes{1.0, 1.0};
  const Vector3 offset{point.x - edge.x * clamped, point.y - edge.y * clamped, point.z - edge.z * clamped};
  return dot(offset, offset);
}

}  // namespace

class TriangleTree::Builder {
 public:
  Builder(const TriangleMesh& mesh, TriangleTree& tree) : mesh_(mesh), tree_(tree) {}

  void run() {
    set_frame();
    make_primitives();
    tree_.nodes_.reserve(primitives_.size() / 4 + 1);
    tree_.pairs_.reserve(primitives_.size() * 2 / 3);
    tree_.triangles_.reserve(primitives_.size() * 4 / 3);
    tree_.triangle_count_ = primitives_.size();
    make_node(whole(0, static_cast<std::uint32_t>(primitives_.size()), 0));
  }

 private:
  void set_frame() {
    glm::dvec3 low(INFINITY);
    glm::dvec3 high(-INFINITY);
    for (const Triangle& t : mesh_.triangles) {
      for (const VertexId v : t) {
        low = glm::min(low, mesh_.positions[v]);
        high = glm::max(high, mesh_.positions[v]);
      }
    }
    tree_.centre_ = (low + high) * 0.5;
    const glm::dvec3 extent = high - low;
    const double largest = std::max({extent.x, extent.y, extent.z});
    tree_.scale_ = largest > 1e-70 ? 1.0 / largest : 1.0;
  }

  void make_primitives() {
    primitives_.resize(mesh_.triangles.size());
    for (std::size_t i = 0; i < primitives_.size(); ++i) {
      const Triangle& t = mesh_.triangles[i];
      Primitive& primitive = primitives_[i];
      primitive.triangle = static_cast<std::uint32_t>(i);
      for (const VertexId v : t) {
        const glm::dvec3 p = (mesh_.positions[v] - tree_.centre_) * tree_.scale_;
        const std::array<float, 3> corner{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
        primitive.box.include({corner, corner});
      }
    }
  }

  Range whole(std::uint32_t begin, std::uint32_t end, int depth) const {
    Range range{begin, end, depth, {}};
    for (std::uint32_t i = begin; i < end; ++i) range.box.include(primitives_[i].box);
    return range;
  }

  Split best_split(const Range& range) const {
    std::array<float, 3> low{INFINITY, INFINITY, INFINITY};
    std::array<float, 3> high{-INFINITY, -INFINITY, -INFINITY};
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float middle = primitives_[i].middle(axis);
        low[axis] = std::min(low[axis], middle);
        high[axis] = std::max(high[axis], middle);
      }
    }
    Split best;
    float best_cost = INFINITY;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!(high[axis] > low[axis])) continue;
      const float bins_per_unit = static_cast<float>(kBins) / (high[axis] - low[axis]);
      if (!std::isfinite(bins_per_unit)) continue;
      Split split{axis, low[axis], bins_per_unit, 0};
      const float cost = choose_bin(range, split);
      if (cost < best_cost) {
        best_cost = cost;
        best = split;
      }
    }
    return best;
  }

  // Sets the first bin of the right side; returns the heuristic's cost.
  float choose_bin(const Range& range, Split& split) const {
    std::array<FloatBox, kBins> boxes;
    std::array<std::uint32_t, kBins> counts{};
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const auto bin = static_cast<std::size_t>(split.bin(primitives_[i]));
      boxes[bin].include(primitives_[i].box);
      ++counts[bin];
    }
    std::array<float, kBins> right_cost{};
    FloatBox right;
    std::uint32_t right_count = 0;
    for (std::size_t bin = kBins - 1; bin > 0; --bin) {
      right.include(boxes[bin]);
      right_count += counts[bin];
      right_cost[bin] = right.half_area() * static_cast<float>(right_count);
    }
    float best_cost = INFINITY;
    FloatBox left;
    std::uint32_t left_count = 0;
    for (std::size_t bin = 1; bin < kBins; ++bin) {
      left.include(boxes[bin - 1]);
      left_count += counts[bin - 1];
      if (left_count == 0 || left_count == range.size()) continue;
      const float cost = left.half_area() * static_cast<float>(left_count) + right_cost[bin];
      if (cost < best_cost) {
        best_cost = cost;
        split.first_right_bin = static_cast<int>(bin);
      }
    }
    return best_cost;
  }

  std::array<Range, 2> divide(const Range& range) {
    const auto begin = primitives_.begin() + range.begin;
    const auto end = primitives_.begin() + range.end;
    auto middle = begin + range.size() / 2;
    const Split split = range.depth < kHeuristicDepth ? best_split(range) : Split{};
    if (split.first_right_bin > 0) {
      middle =
          std::partition(begin, end, [&split](const Primitive& p) { return split.bin(p) < split.first_right_bin; });
    }  // otherwise all centres coincide or the tree is too deep: any halves will do
    const auto cut = static_cast<std::uint32_t>(middle - primitives_.begin());
    return {whole(range.begin, cut, range.depth + 1), whole(cut, range.end, range.depth + 1)};
  }

  std::uint32_t make_node(const Range& range) {
    const auto index = static_cast<std::uint32_t>(tree_.nodes_.size());
    tree_.nodes_.emplace_back();
    std::array<Range, kChildren> children;
    children[0] = range;
    std::size_t count = 1;
    while (count < kChildren) {
      std::size_t largest = kChildren;
      for (std::size_t i = 0; i < count; ++i) {
        if (children[i].size() <= kLeafTriangles) continue;
        if (largest == kChildren || children[i].box.half_area() > children[largest].box.half_area()) largest = i;
      }
      if (largest == kChildren) break;
      const std::array<Range, 2> halves = divide(children[largest]);
      children[largest] = halves[0];
      children[count++] = halves[1];
    }
    for (std::size_t i = 0; i < kChildren; ++i) set_child(index, i, i < count ? children[i] : Range{});
    return index;
  }

  void set_child(std::uint32_t node_index, std::size_t i, const Range& range) {
    const bool leaf = range.size() <= kLeafTriangles;
    // No node has the root as its child, so 0 stands for an empty one.
    const std::uint32_t child = range.size() == 0 ? 0 : leaf ? make_leaf(range) : make_node(range);
    Node& node = tree_.nodes_[node_index];
    node.child[i] = child;
    node.pair_count[i] = leaf ? (range.size() + 1) / 2 : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      node.low[axis][i] = range.box.low[axis] - kBoxPadding;
      node.high[axis][i] = range.box.high[axis] + kBoxPadding;
    }
  }

  std::uint32_t make_leaf(const Range& range) {
    const auto first = static_cast<std::uint32_t>(tree_.pairs_.size());
    for (std::uint32_t i = range.begin; i < range.end; i += 2) {
      Pair& pair = tree_.pairs_.emplace_back();
      for (int lane = 0; lane < 2; ++lane) {
        const std::uint32_t triangle =
            primitives_[std::min(i + static_cast<std::uint32_t>(lane), range.end - 1)].triangle;
        const Triangle& t = mesh_.triangles[triangle];
        for (int axis = 0; axis < 3; ++axis) {
          pair.a[axis][lane] = mesh_.positions[t[0]][axis];
          pair.b[axis][lane] = mesh_.positions[t[1]][axis];
          pair.c[axis][lane] = mesh_.positions[t[2]][axis];
        }
        tree_.triangles_.push_back(triangle);
      }
    }
    return first;
  }

  const TriangleMesh& mesh_;
  TriangleTree& tree_;
  std::vector<Primitive> primitives_;
};

Result<TriangleTree> TriangleTree::build(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return fail(ErrorKind::bad_input, "the mesh has no triangles, so it has no surface");
  if (mesh.triangles.size() >= (std::size_t{1} << 31)) {
    return fail(ErrorKind::limit,
                "the mesh has " + std::to_string(mesh.triangles.size()) + " triangles; at most 2^31 - 1");
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const VertexId v : mesh.triangles[i]) {
      if (v >= mesh.positions.size()) {
        return fail(ErrorKind::bad_input, "triangle " + std::to_string(i) + " names vertex " + std::to_string(v) +
                                              " of " + std::to_string(mesh.positions.size()));
      }
      const glm::dvec3& p = mesh.positions[v];
      for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(p[axis]) < kLargestCoordinate) continue;  // false for NaN
        return fail(ErrorKind::bad_input,
                    "vertex " + std::to_string(v) + " has a coordinate that is not finite or too large");
      }
    }
  }
  TriangleTree tree;
  Builder(mesh, tree).run();
  return tree;
}

std::vector<std::uint32_t> TriangleTree::triangles_in_order() const {
  std::vector<std::uint32_t> order;
  order.reserve(triangle_count_);
  for (std::size_t slot = 0; slot < triangles_.size(); ++slot) {
    const bool repeated = slot % 2 == 1 && triangles_[slot] == triangles_[slot - 1];
    if (!repeated) order.push_back(triangles_[slot]);
  }
  return order;
}

// closest_point_on_triangle for two triangles at once and without branches.
TriangleTree::TwoDoubles TriangleTree::squared_distances(const TwoDoubles (&query)[3], const Pair& pair) {
  const Vector3 aq = Vector3{query[0], query[1], query[2]} - Vector3{pair.a[0], pair.a[1], pair.a[2]};
  const Vector3 bq = Vector3{query[0], query[1], query[2]} - Vector3{pair.b[0], pair.b[1], pair.b[2]};
  const Vector3 ab = Vector3{pair.b[0], pair.b[1], pair.b[2]} - Vector3{pair.a[0], pair.a[1], pair.a[2]};
  const Vector3 ac = Vector3{pair.c[0], pair.c[1], pair.c[2]} - Vector3{pair.a[0], pair.a[1], pair.a[2]};
  const Vector3 bc = Vector3{pair.c[0], pair.c[1], pair.c[2]} - Vector3{pair.b[0], pair.b[1], pair.b[2]};
  const Lanes to_ab = squared_to_edge(aq, ab, dot(ab, ab));
  const Lanes to_ac = squared_to_edge(aq, ac, dot(ac, ac));
  const Lanes to_bc = squared_to_edge(bq, bc, dot(bc, bc));
  const Lanes to_two = to_ab < to_ac ? to_ab : to_ac;
  const Lanes to_edges = to_two < to_bc ? to_two : to_bc;

  const Vector3 normal = cross(ab, ac);
  const Lanes area = dot(normal, normal);
  const Lanes weight_b = dot(cross(aq, ac), normal);
  const Lanes weight_c = dot(cross(ab, aq), normal);
  const Lanes weight_a = area - weight_b - weight_c;
  const auto inside = (area > 0.0) & (weight_a >= 0.0) & (weight_b >= 0.0) & (weight_c >= 0.0);
  const Lanes b = weight_b / area;
  const Lanes c = weight_c / area;
  const Vector3 offset{aq.x - ab.x * b - ac.x * c, aq.y - ab.y * b - ac.y * c, aq.z - ab.z * b - ac.z * c};
  const Lanes to_inside = dot(offset, offset);
  return (inside & (to_inside < to_edges)) ? to_inside : to_edges;
}

void TriangleTree::offer(const TwoDoubles (&query)[3], std::uint32_t pair, Nearest& best) const {
  const TwoDoubles squared = squared_distances(query, pairs_[pair]);
  for (std::uint32_t lane = 0; lane < 2; ++lane) {
    if (squared[lane] < best.squared_distance) best = {squared[lane], pair * 2 + lane};
  }
}

SurfacePoint TriangleTree::closest(const glm::dvec3& query, std::uint32_t hint) const {
  assert(!pairs_.empty());
  const TwoDoubles lanes[3] = {{query.x, query.x}, {query.y, query.y}, {query.z, query.z}};
  Nearest best;
  offer(lanes, hint / 2 < pairs_.size() ? hint / 2 : 0, best);

  // Clamping can only bring a query nearer to the boxes, which costs time and no correctness.
  const glm::dvec3 local = glm::clamp((query - centre_) * scale_, -kFarthest, kFarthest);
  const float at[3] = {static_cast<float>(local.x), static_cast<float>(local.y), static_cast<float>(local.z)};
  const double squared_scale = scale_ * scale_;
  // The factor covers what float arithmetic loses on queries far outside, where the padding is too small to do so.
  const auto limit_of = [squared_scale](double squared) {
    return static_cast<float>(std::min(squared * squared_scale * (1.0 + 4e-6), 12.1 * kFarthest * kFarthest));
  };
  float limit = limit_of(best.squared_distance);

  struct Pending {
    float squared_distance;
    std::uint32_t child;
    std::uint32_t pair_count;
  };
  std::array<Pending, kStackSize> stack;
  std::size_t stack_size = 0;
  stack[stack_size++] = {0.0F, 0, 0};
  while (stack_size > 0 && best.squared_distance > 0.0) {
    const Pending next = stack[--stack_size];
    if (next.squared_distance > limit) continue;
    if (next.pair_count > 0) {
      for (std::uint32_t i = 0; i < next.pair_count; ++i) offer(lanes, next.child + i, best);
      limit = limit_of(best.squared_distance);
      continue;
    }
    const Node& node = nodes_[next.child];
    FourFloats squared{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const FourFloats below = node.low[axis] - at[axis];
      const FourFloats above = at[axis] - node.high[axis];
      const FourFloats outside = below > above ? below : above;
      const FourFloats gap = outside > 0.0F ? outside : FourFloats{};
      squared += gap * gap;
    }
    // Pushed in order of decreasing distance, so that the nearest child comes off the stack first.
    const std::size_t bottom = stack_size;
    for (int i = 0; i < kChildren; ++i) {
      if (!(squared[i] <= limit)) continue;
      if (node.pair_count[i] == 0 && node.child[i] == 0) continue;
      std::size_t place = stack_size++;
      for (; place > bottom && stack[place - 1].squared_distance < squared[i]; --place) stack[place] = stack[place - 1];
      stack[place] = {squared[i], node.child[i], node.pair_count[i]};
    }
  }
  const Pair& pair = pairs_[best.slot / 2];
  const int lane = static_cast<int>(best.slot % 2);
  const glm::dvec3 position =
      closest_point_on_triangle(query, pair.corner_a(lane), pair.corner_b(lane), pair.corner_c(lane));
  return {position, glm::dot(query - position, query - position), best.slot};
}

}  // namespace fanstream
