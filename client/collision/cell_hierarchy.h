// A tree of four branches over all cells of an asset, for searches that take the logarithm of the model's size.
//
// The cells form a tree of their own, of few levels and wide; sibling cells are numbered in the order of a kd-tree
// (partition_vertices), so quartering their ranges joins those that lie together.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/asset/asset_layout.h"

namespace fanstream {

// Immutable; thread safe.
class CellHierarchy {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr std::uint32_t kWidth = 4;
  // What a search keeps by node is in arrays of its own, by slot: slot k of node n is 4 n + k.
  struct Node {
    std::uint32_t parent = kNone;                                         // the slot above
    std::array<std::uint32_t, kWidth> cell{kNone, kNone, kNone, kNone};   // of a slot that stands for one cell
    std::array<std::uint32_t, kWidth> below{kNone, kNone, kNone, kNone};  // a node: of a cell, over its children
  };

  CellHierarchy(const AssetHead& head, const AssetIndex& index);

  // At least 1: the root, of an asset without cells without anything below.
  std::size_t node_count() const { return nodes_.size(); }
  static constexpr std::uint32_t root() { return 0; }
  // Nodes below have larger numbers.
  const Node& node(std::uint32_t n) const { return nodes_[n]; }
  std::uint32_t slot_of(std::uint32_t cell) const { return of_cell_[cell]; }
  std::uint32_t below(std::uint32_t slot) const { return nodes_[slot / kWidth].below[slot % kWidth]; }

 private:
  std::uint32_t add(std::uint32_t parent, std::uint32_t first_cell, std::uint32_t count, const AssetIndex& index);
  void fill(std::uint32_t slot, std::uint32_t first_cell, std::uint32_t count, const AssetIndex& index);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> of_cell_;
};

}  // namespace fanstream
