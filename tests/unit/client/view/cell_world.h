// A make-believe model: rectangles on a globe, cut into smaller ones slab by slab, and a mesh of them that obeys the
// rule of dependencies. For tests and the benchmark of the planner.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "client/view/planner.h"
#include "tests/support/seeded_random.h"

namespace fanstream::testing {

struct CellWorldShape {
  std::uint32_t roots = 4;
  std::uint32_t slabs = 3;
  std::uint32_t least_children = 2;
  std::uint32_t most_children = 4;
  std::uint32_t most_layers = 3;       // of a slab; 1 to this many, at random
  bool fixed_layers = false;           // always most_layers
  std::uint32_t most_generations = 1;  // of a layer; 1 to this many, at random
  double base_error = 0.2;             // the globe's radius is 1
  double decay = 0.7;                  // of the error with each layer
};

// What a cell needs where it may take up a generation when all cells beside it have every one before: those of finer
// slabs stand for the cell of its slab that they come from.
inline std::vector<Dependency> needs_beside(const CellTable& table, std::uint32_t cell,
                                            std::span<const std::uint32_t> beside) {
  std::vector<Dependency> needs;
  const std::uint32_t slab = table.slab_of(cell);
  const auto need_all = [&](std::uint32_t n) { needs.push_back({1, n, table.generations_of(table.slab_of(n))}); };
  for (std::uint32_t n : beside) {
    while (table.slab_of(n) > slab) n = table.parent(n);
    if (n == cell) continue;
    if (table.slab_of(n) < slab) {
      need_all(n);
      continue;
    }
    if (slab > 0) need_all(table.parent(n));
    for (std::uint32_t g = 2; g <= table.generations_of(slab); ++g) needs.push_back({g, n, g - 1});
  }
  return needs;
}

class CellWorld {
 public:
  struct Box {
    double u0 = 0.0, u1 = 1.0, v0 = 0.0, v1 = 1.0;
  };

  CellWorld(const CellWorldShape& shape, SeededRandom& random) {
    std::vector<SlabShape> slabs;
    std::vector<std::uint32_t> child_counts;
    std::vector<std::uint32_t> leaves;
    cut({}, shape.roots, boxes_);
    std::uint32_t begin = 0;
    for (std::uint32_t s = 0; s < shape.slabs; ++s) {
      const auto end = static_cast<std::uint32_t>(boxes_.size());
      slabs.push_back({end - begin, shape.fixed_layers ? shape.most_layers : 1 + random.below(shape.most_layers)});
      link(begin, end);
      // What has no children ends there, beside cells of all finer slabs.
      for (std::uint32_t c = begin; c < end; ++c) {
        for (const std::uint32_t leaf : leaves) {
          if (touch(boxes_[leaf], boxes_[c])) beside_[c].push_back(leaf);
        }
      }
      if (s + 1 < shape.slabs) {
        for (std::uint32_t c = begin; c < end; ++c) {
          const auto children = static_cast<std::uint32_t>(
              random.between(static_cast<int>(shape.least_children), static_cast<int>(shape.most_children)));
          child_counts.push_back(children);
          if (children == 0) leaves.push_back(c);
          cut(Box(boxes_[c]), children, boxes_);
        }
      }
      begin = end;
    }
    auto created = CellTable::create(slabs, child_counts);
    if (!created) throw std::runtime_error(created.error().message);
    table_ = std::move(*created);
    join_generations(shape.most_generations, random);
    fill(shape, random);
    refresh();
  }

  CellTable& table() { return table_; }
  const CellTable& table() const { return table_; }
  bool live(std::uint32_t cell) const {
    const std::uint32_t parent = table_.parent(cell);
    return parent == CellTable::kNoCell || (complete(parent) && live(parent));
  }
  bool complete(std::uint32_t cell) const { return done_[cell] == slab_generations(table_.slab_of(cell)); }
  bool front(std::uint32_t cell) const { return live(cell) && !(complete(cell) && table_.child_count(cell) > 0); }
  // Cells of the mesh beside a live cell, coarser and finer ones too.
  std::vector<std::uint32_t> neighbours(std::uint32_t cell) const {
    std::vector<std::uint32_t> all;
    for (std::uint32_t n : beside_[cell]) {
      while (!live(n)) n = table_.parent(n);
      descend(n, boxes_[cell], all);
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    std::erase(all, cell);
    return all;
  }
  // Generations of the asset that a cell has.
  std::uint32_t generations(std::uint32_t cell) const {
    std::uint32_t sum = done_[cell];
    for (std::uint32_t s = 0; s < table_.slab_of(cell); ++s) sum += slab_generations(s);
    return sum;
  }
  // Whether the mesh could be in this state at all.
  bool legal() const {
    for (std::uint32_t c = 0; c < table_.cell_count(); ++c) {
      if (!live(c) && done_[c] != 0) return false;
      if (!front(c)) continue;
      for (const std::uint32_t n : neighbours(c)) {
        if (generations(n) + 1 < generations(c) && !finished_leaf(n)) return false;
      }
    }
    return true;
  }

  // Goes to the largest mesh within the targets and what is held that the rule allows, in random order.
  void move_to(const std::vector<std::uint8_t>& targets, SeededRandom& random) {
    std::vector<std::uint32_t> order(table_.cell_count());
    for (std::uint32_t c = 0; c < order.size(); ++c) order[c] = c;
    random.shuffle(order);
    const auto limit = [&](std::uint32_t c) {
      return generations_of(table_.slab_of(c), std::min<std::uint32_t>(targets[c], table_.held(c)));
    };
    for (const std::uint32_t c : order) {
      while (done_[c] > limit(c)) undo(c);
    }
    for (bool changed = true; changed;) {
      changed = false;
      for (const std::uint32_t c : order) {
        if (!front(c) || done_[c] >= limit(c) || !may_apply(c)) continue;
        ++done_[c];
        changed = true;
      }
    }
    refresh();
  }
  void evict(const std::vector<Eviction>& evictions) {
    for (const Eviction& e : evictions) table_.set_held(e.cell, e.keep_prefix);
  }
  // What a client tells the table after each change: bounds and neighbours of live cells.
  void refresh() {
    for (std::uint32_t c = 0; c < table_.cell_count(); ++c) {
      const std::uint32_t slab = table_.slab_of(c);
      std::uint32_t whole = 0;
      while (whole < table_.layers_of(slab) && generations_of(slab, whole + 1) <= done_[c]) ++whole;
      table_.set_applied(c, whole, whole + (generations_of(slab, whole) < done_[c]));
      if (!live(c)) continue;
      if (!table_.extent_known(c)) table_.set_extent(c, extent_of_box(boxes_[c]));
      table_.add_needs(c, needs_beside(table_, c, neighbours(c)));
    }
  }
  void reveal_extents() {
    for (std::uint32_t c = 0; c < table_.cell_count(); ++c) table_.set_extent(c, extent_of_box(boxes_[c]));
  }
  void reveal_everything() {
    reveal_extents();
    for (std::uint32_t c = 0; c < table_.cell_count(); ++c) table_.add_needs(c, needs_beside(table_, c, beside_[c]));
  }
  // Those of its slab, and coarser ones that have no children.
  std::span<const std::uint32_t> beside(std::uint32_t cell) const { return beside_[cell]; }

 private:
  static glm::dvec3 place(double u, double v) {
    const double longitude = 2.0 * std::numbers::pi * u;
    const double latitude = std::numbers::pi * (0.02 + 0.96 * v);
    return {std::sin(latitude) * std::cos(longitude), std::cos(latitude), std::sin(latitude) * std::sin(longitude)};
  }
  static CellExtent extent_of_box(const Box& box) {
    constexpr int kSamples = 5;
    std::vector<glm::dvec3> points;
    CellExtent bounds;
    for (int i = 0; i < kSamples; ++i) {
      for (int j = 0; j < kSamples; ++j) {
        points.push_back(place(box.u0 + (box.u1 - box.u0) * i / (kSamples - 1.0),
                               box.v0 + (box.v1 - box.v0) * j / (kSamples - 1.0)));
        bounds.center += points.back() / static_cast<double>(kSamples * kSamples);
      }
    }
    for (const glm::dvec3& p : points) bounds.radius = std::max(bounds.radius, 1.05 * glm::distance(p, bounds.center));
    if (glm::length(bounds.center) < 0.1) return bounds;
    bounds.cone_axis = glm::normalize(bounds.center);
    bounds.cone_cosine = 1.0;
    for (const glm::dvec3& p : points) bounds.cone_cosine = std::min(bounds.cone_cosine, glm::dot(p, bounds.cone_axis));
    bounds.cone_cosine = std::max(-1.0, bounds.cone_cosine - 0.02);
    return bounds;
  }
  static void cut(const Box& box, std::uint32_t parts, std::vector<Box>& out) {
    if (parts <= 1) {
      if (parts == 1) out.push_back(box);
      return;
    }
    Box low = box;
    Box high = box;
    const double share = static_cast<double>(parts / 2) / parts;
    if (box.u1 - box.u0 >= box.v1 - box.v0) {
      low.u1 = high.u0 = box.u0 + (box.u1 - box.u0) * share;
    } else {
      low.v1 = high.v0 = box.v0 + (box.v1 - box.v0) * share;
    }
    cut(low, parts / 2, out);
    cut(high, parts - parts / 2, out);
  }
  static bool touch(const Box& a, const Box& b) {
    constexpr double kRoom = 1e-9;
    return a.u0 <= b.u1 + kRoom && b.u0 <= a.u1 + kRoom && a.v0 <= b.v1 + kRoom && b.v0 <= a.v1 + kRoom;
  }
  // Neighbours within [begin, end), by a sweep along u.
  void link(std::uint32_t begin, std::uint32_t end) {
    beside_.resize(end);
    std::vector<std::uint32_t> order;
    double widest = 0.0;
    for (std::uint32_t c = begin; c < end; ++c) {
      order.push_back(c);
      widest = std::max(widest, boxes_[c].u1 - boxes_[c].u0);
    }
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return boxes_[a].u0 < boxes_[b].u0; });
    for (std::size_t i = 0; i < order.size(); ++i) {
      for (std::size_t j = i + 1; j < order.size() && boxes_[order[j]].u0 <= boxes_[order[i]].u1 + 1e-9; ++j) {
        if (!touch(boxes_[order[i]], boxes_[order[j]])) continue;
        beside_[order[i]].push_back(order[j]);
        beside_[order[j]].push_back(order[i]);
      }
    }
  }
  void fill(const CellWorldShape& shape, SeededRandom& random) {
    std::uint32_t layer = 0;
    for (std::uint32_t s = 0; s < table_.slab_count(); ++s) {
      for (std::uint32_t p = 1; p <= table_.layers_of(s); ++p, ++layer) {
        for (std::uint32_t c = table_.first_cell(s); c < table_.first_cell(s) + table_.cells_of(s); ++c) {
          double limit = shape.base_error;
          if (p > 1) {
            limit = table_.errors()[table_.step_index(c, p - 1)];
          } else if (const std::uint32_t parent = table_.parent(c); parent != CellTable::kNoCell) {
            limit = table_.errors()[table_.step_index(parent, table_.segment_count(parent))];
          }
          const double error = shape.base_error * std::pow(shape.decay, layer) * (0.6 + 0.8 * random.unit());
          const std::uint32_t size = random.one_in(20) ? 0 : 2 * (20 + random.below(200));
          table_.set_segment(c, p - 1, {static_cast<float>(std::min(limit, error)), size, size / 2});
        }
      }
    }
    table_.set_base(100, 5000);
  }
  void descend(std::uint32_t cell, const Box& box, std::vector<std::uint32_t>& out) const {
    if (!touch(boxes_[cell], box)) return;
    if (front(cell)) {
      out.push_back(cell);
      return;
    }
    for (std::uint32_t i = 0; i < table_.child_count(cell); ++i) descend(table_.first_child(cell) + i, box, out);
  }
  bool finished_leaf(std::uint32_t cell) const { return complete(cell) && table_.child_count(cell) == 0; }
  bool may_apply(std::uint32_t cell) const {
    if (complete(cell)) return false;
    for (const std::uint32_t n : neighbours(cell)) {
      if (generations(n) < generations(cell) && !finished_leaf(n)) return false;
    }
    return true;
  }
  // Takes back a generation, and before it what needs it.
  void undo(std::uint32_t cell) {
    if (done_[cell] == 0) return undo(table_.parent(cell));
    if (complete(cell)) {
      for (std::uint32_t i = 0; i < table_.child_count(cell); ++i) {
        while (done_[table_.first_child(cell) + i] > 0) undo(table_.first_child(cell) + i);
      }
    }
    for (bool again = true; again;) {
      again = false;
      for (const std::uint32_t n : neighbours(cell)) {
        if (generations(n) <= generations(cell)) continue;
        undo(n);
        again = true;
        break;
      }
    }
    --done_[cell];
  }
  // Of the first layers of a slab.
  std::uint32_t generations_of(std::uint32_t slab, std::uint32_t layers) const {
    std::uint32_t sum = 0;
    for (std::uint32_t l = 0; l < layers; ++l) sum += table_.layer_generations(slab, l);
    return sum;
  }
  std::uint32_t slab_generations(std::uint32_t slab) const { return generations_of(slab, table_.layers_of(slab)); }
  void join_generations(std::uint32_t most, SeededRandom& random) {
    done_.assign(table_.cell_count(), 0);
    for (std::uint32_t s = 0; most > 1 && s < table_.slab_count(); ++s) {
      for (std::uint32_t l = 0; l < table_.layers_of(s); ++l)
        table_.set_layer_generations(s, l, 1 + random.below(most));
    }
  }

  CellTable table_;
  std::vector<std::uint32_t> done_;  // generations, by cell
  std::vector<Box> boxes_;
  std::vector<std::vector<std::uint32_t>> beside_;
};

// Somewhere around the globe, inside or far away at times.
inline View random_view(SeededRandom& random) {
  const auto direction = [&] {
    const double z = 2.0 * random.unit() - 1.0;
    const double angle = 2.0 * std::numbers::pi * random.unit();
    const double r = std::sqrt(1.0 - z * z);
    return glm::dvec3(r * std::cos(angle), r * std::sin(angle), z);
  };
  View view;
  const double distance = random.one_in(8) ? random.unit() : 1.05 + 6.0 * random.unit() * random.unit();
  view.camera.eye = direction() * distance;
  view.camera.target = view.camera.eye - glm::normalize(view.camera.eye) + 0.6 * random.unit() * direction();
  view.camera.up = direction();
  view.camera.fov_deg = 10.0 + 90.0 * random.unit();
  view.width_px = 200 + random.below(1800);
  view.height_px = 200 + random.below(1000);
  return check_view(view) ? view : random_view(random);
}

}  // namespace fanstream::testing
