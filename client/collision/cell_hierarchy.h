// A binary tree over all cells of an asset, for searches that take the logarithm of the model's size.
//
// The cells form a tree of their own, of few levels and wide; sibling cells are numbered in the order of a kd-tree
// (partition_vertices), so halving their ranges joins those that lie together.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/asset/asset_layout.h"

namespace fanstream {

// The box of nothing: what is added to it is the sum.
inline constexpr Bounds kNoBounds{glm::dvec3(std::numeric_limits<double>::infinity()),
                                  glm::dvec3(-std::numeric_limits<double>::infinity())};
Bounds united(const Bounds& a, const Bounds& b);

// Immutable; thread safe.
class CellHierarchy {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  struct Node {
    std::uint32_t parent = kNone;
    // Of a cell: the root of its children's tree first, the second kNone. Of any other node: both halves.
    std::array<std::uint32_t, 2> below{kNone, kNone};
    std::uint32_t cell = kNone;
  };

  CellHierarchy() = default;
  CellHierarchy(const AssetHead& head, const AssetIndex& index);

  bool is_empty() const { return nodes_.empty(); }
  std::size_t node_count() const { return nodes_.size(); }
  static constexpr std::uint32_t root() { return 0; }
  const Node& node(std::uint32_t n) const { return nodes_[n]; }
  std::uint32_t node_of(std::uint32_t cell) const { return of_cell_[cell]; }

  // Goes down from the root: `enter(node)` says whether to go on below a node. Nearer to the root comes first.
  template <class Enter>
  void descend(const Enter& enter) const {
    if (!nodes_.empty()) descend_from(root(), enter);
  }

 private:
  std::uint32_t add(std::uint32_t parent, std::uint32_t first_cell, std::uint32_t count, const AssetIndex& index);
  template <class Enter>
  void descend_from(std::uint32_t n, const Enter& enter) const {
    if (!enter(n)) return;
    for (const std::uint32_t below : nodes_[n].below) {
      if (below != kNone) descend_from(below, enter);
    }
  }

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> of_cell_;
};

}  // namespace fanstream
