#include "client/collision/live_surface.h"

#include <algorithm>
#include <numeric>

namespace fanstream {

namespace {
constexpr std::uint32_t kWidth = CellHierarchy::kWidth;
}  // namespace

// A leaf while it is made.
struct LiveSurface::Part {
  std::uint32_t first = Block::kNone;  // and latest block
  std::uint32_t last = Block::kNone;
  std::uint32_t triangles = 0;
  FloatBox box;  // not yet padded
};

LiveSurface::LiveSurface(const ProgressiveMesh& mesh, const CellHierarchy& cells)
    : mesh_(mesh), cells_(cells), frame_(BoxFrame::of(mesh.head().grid)), nodes_(cells.node_count()) {
  if (!mesh.index().cells.empty()) return;
  CellVertices all;
  all.initial.resize(mesh_.vertex_count());
  std::iota(all.initial.begin(), all.initial.end(), 0U);
  put_leaf(kWidth * CellHierarchy::root(), all);
  sum_up_changes();
}

// --- Leaves ---

void LiveSurface::take_leaf(std::uint32_t slot) {
  const std::uint32_t below = nodes_[slot / kWidth].below[slot % kWidth];
  if ((below & Node::kLeaf) == 0) return;
  const std::uint32_t first = below & ~Node::kLeaf;
  std::uint32_t last = first;
  while (blocks_[last].next != Block::kNone) last = blocks_[last].next;
  blocks_[last].next = free_;
  free_ = first;
}

void LiveSurface::add_triangle(Part& part, std::array<VertexId, 3> numbers, const std::array<glm::dvec3, 3>& corners) {
  if (part.triangles % kWidth == 0) {
    std::uint32_t made = free_;
    if (made == Block::kNone) {
      made = static_cast<std::uint32_t>(blocks_.size());
      blocks_.emplace_back();
    } else {
      free_ = blocks_[made].next;
    }
    (part.first == Block::kNone ? part.first : blocks_[part.last].next) = made;
    part.last = made;
    Block& block = blocks_[made];
    block.next = Block::kNone;
    block.count = block.originals = 0;
    for (auto& corner : block.rounded) corner.fill(float4(std::numeric_limits<float>::quiet_NaN()));
  }
  Block& block = blocks_[part.last];
  const std::size_t k = block.count++;
  bool original = true;
  for (std::size_t c = 0; c < 3; ++c) {
    const glm::vec3 rounded = frame_.to_float(corners[c]);
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      block.rounded[c][a][k] = rounded[axis];
      part.box.low[a] = std::min(part.box.low[a], rounded[axis]);
      part.box.high[a] = std::max(part.box.high[a], rounded[axis]);
    }
    original = original && mesh_.state().vertices[numbers[c]].context.next == kNeverSplit;
  }
  block.corners[k] = corners;
  block.numbers[k] = numbers;
  block.originals = static_cast<std::uint8_t>(block.originals | (original ? 1U << k : 0U));
  ++part.triangles;
}

// The triangles of which the cell owns the vertex of the smallest number: so every triangle of the mesh is in the leaf
// of exactly one cell.
void LiveSurface::put_leaf(std::uint32_t slot, const CellVertices& cell) {
  const FanState& state = mesh_.state();
  const PositionGrid& grid = mesh_.head().grid;
  const LinkedFans::Corner* const corners = state.fans.corners();
  Part part;
  for (std::uint32_t i = 0; i < cell.count(); ++i) {
    const VertexId v = cell.at(i);
    const auto counts = [v](VertexId w) { return v < w && w != kOutside; };
    const auto place = [&](VertexId w) { return counts(w) ? grid.decode(state.vertices[w].place) : glm::dvec3(0.0); };
    LinkedFans::Corner corner = corners[state.fans.corner(v)];
    const glm::dvec3 at = grid.decode(state.vertices[v].place);
    VertexId first = corner.neighbour;
    glm::dvec3 first_at = place(first);
    for (std::uint32_t left = state.fans.ring_size(v); left > 0; --left) {
      corner = corners[corner.next];
      const VertexId second = corner.neighbour;
      const glm::dvec3 second_at = place(second);
      if (counts(first) && counts(second)) add_triangle(part, {v, first, second}, {at, first_at, second_at});
      first = second;
      first_at = second_at;
    }
  }
  if (part.triangles == 0) {
    set_slot(slot, 0, {}, 0);
    return;
  }
  const auto padding = static_cast<float>(frame_.padding);
  for (std::size_t a = 0; a < 3; ++a) {
    part.box.low[a] -= padding;
    part.box.high[a] += padding;
  }
  set_slot(slot, Node::kLeaf | part.first, part.box, part.triangles);
}

// --- Sums ---

void LiveSurface::note_change(std::uint32_t node) {
  changed_.push_back(node);
  std::push_heap(changed_.begin(), changed_.end());
}

void LiveSurface::set_slot(std::uint32_t slot, std::uint32_t below, const FloatBox& box, std::uint32_t triangles) {
  Node& node = nodes_[slot / kWidth];
  const std::uint32_t k = slot % kWidth;
  node.below[k] = below;
  if (node.triangles[k] == triangles && node.boxes.box(k) == box) return;
  node.triangles[k] = triangles;
  node.boxes.set(k, box);
  note_change(slot / kWidth);
}

// Nodes below have larger numbers, so each is gone through once.
void LiveSurface::sum_up_changes() {
  while (!changed_.empty()) {
    const std::uint32_t n = changed_.front();
    while (!changed_.empty() && changed_.front() == n) {
      std::pop_heap(changed_.begin(), changed_.end());
      changed_.pop_back();
    }
    const auto& counts = nodes_[n].triangles;
    const std::uint32_t triangles = counts[0] + counts[1] + counts[2] + counts[3];
    const std::uint32_t parent = cells_.node(n).parent;
    if (parent == CellHierarchy::kNone) {
      triangle_count_ = triangles;
      continue;
    }
    // A cell that has its vertices for itself again has none below.
    if ((nodes_[parent / kWidth].below[parent % kWidth] & Node::kLeaf) != 0) continue;
    set_slot(parent, n, nodes_[n].boxes.sum(), triangles);
  }
}

void LiveSurface::update(std::span<const std::uint32_t> changed_cells) {
  for (const std::uint32_t c : changed_cells) {
    const std::uint32_t slot = cells_.slot_of(c);
    take_leaf(slot);
    if (mesh_.is_live(c)) continue;
    const std::uint32_t below = cells_.below(slot);
    set_slot(slot, 0, {}, 0);
    if (below != CellHierarchy::kNone) note_change(below);
  }
  for (const std::uint32_t c : changed_cells) {
    if (mesh_.is_live(c)) put_leaf(cells_.slot_of(c), mesh_.vertices(c));
  }
  sum_up_changes();
}

TriangleMesh LiveSurface::triangle_mesh(std::vector<bool>* original) const {
  if (original != nullptr) original->clear();
  std::vector<std::pair<VertexId, glm::dvec3>> vertices;
  std::vector<Triangle> triangles;
  triangles.reserve(triangle_count());
  visit([](const Bounds&) { return true; },
        [&](const LiveTriangle& t) {
          for (std::size_t c = 0; c < 3; ++c) vertices.emplace_back(t.numbers[c], t.corners[c]);
          triangles.push_back({t.numbers[0], t.numbers[1], t.numbers[2]});
          if (original != nullptr) original->push_back(t.original);
        });
  const auto before = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::sort(vertices.begin(), vertices.end(), before);
  const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
  vertices.erase(std::unique(vertices.begin(), vertices.end(), same), vertices.end());
  TriangleMesh mesh;
  for (const auto& [number, position] : vertices) mesh.positions.push_back(position);
  for (Triangle& t : triangles) {
    for (VertexId& v : t) {
      const auto at = std::lower_bound(vertices.begin(), vertices.end(), std::pair(v, glm::dvec3(0.0)), before);
      v = static_cast<VertexId>(at - vertices.begin());
    }
  }
  mesh.triangles = std::move(triangles);
  return mesh;
}

}  // namespace fanstream
