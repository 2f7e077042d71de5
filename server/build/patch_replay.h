// The mesh between the generations of a history, fine to coarse, patch by patch: its faces, and which of them a patch
// covers.
#pragma once

#include <span>
#include <vector>

#include "common/grid/position_grid.h"
#include "server/build/coded_history.h"
#include "server/build/star_distance.h"

namespace fanstream {

// Faces keep their number as long as they exist: one with a single corner among the vertices that a patch merges stays,
// with the root in that corner's place; those with two or three vanish. Vertices are renumbered so that those close in
// space have close numbers, faces likewise; places are in grid steps, whole numbers below 2^20, which floats hold
// exactly. Keeps references to its arguments. Not thread safe.
class PatchReplay {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  struct Face {
    VertexId corners[3];
    std::uint32_t covered_by = kNone;  // the last patch that has
    std::uint32_t in_star = 0;         // its number in the star of that patch
    bool is_gone() const { return corners[0] == kNone; }
  };

  // `codes` are the places of the full model's vertices, `triangles` its faces.
  PatchReplay(const std::vector<Triangle>& triangles, std::vector<GridPoint> codes, const PositionGrid& grid,
              const CodedHistory& coded);

  // Calls begin(patches) once in each generation, then patch(number) for each of its patches when its star stands;
  // neighbours follow each other. Patches are numbered on from generation to generation, in the order of their first
  // merges.
  template <class Begin, class Patch>
  void run(Begin&& begin, Patch&& patch) {
    for (std::uint32_t k = 0; k < coded_.history.generation_count(); ++k) {
      gather_patches(k);
      begin(first_patch_ + static_cast<std::uint32_t>(roots_.size()));
      for (const std::uint32_t p : order_) {
        cover(p);
        make_star();
        patch(patch_);
      }
    }
  }

  std::size_t vertex_count() const { return places_.size(); }
  const glm::vec3& place(VertexId v) const { return places_[v]; }  // before the first generation: in the full model
  const std::vector<Face>& faces() const { return faces_; }
  const std::vector<std::uint32_t>& patch_of_merge() const { return patch_of_; }

  // Of the patch at hand.
  const glm::vec3& centre() const { return places_[root_]; }
  std::span<const std::uint32_t> covered() const { return covered_; }  // faces, those that are gone among them
  bool is_covered(std::uint32_t face) const { return faces_[face].covered_by == patch_; }
  const StarDistance& star() const { return star_; }                         // around centre()
  std::span<const std::uint32_t> star_faces() const { return star_faces_; }  // in the star's order
  float extent() const { return extent_; }  // the largest coordinate of a corner of the star, seen from the centre
  // The edge from the centre between a face of the star and the next.
  glm::vec3 edge_after(std::uint32_t face) const { return places_[rest_[face].to] - centre(); }

 private:
  struct Range {
    std::uint32_t begin = 0;
    std::uint32_t size = 0;
  };
  struct StarFace {
    std::uint32_t face;
    VertexId from, to;
  };

  glm::vec3 value_of(const GridPoint& code) const;
  void place_vertices(const std::vector<Triangle>& triangles);
  void place_faces(const std::vector<Triangle>& triangles);
  void gather_patches(std::uint32_t k);
  void gather_absorbed(std::uint32_t begin, std::uint32_t end);
  void cover(std::uint32_t p);
  void make_star();
  void order_rest();

  const CodedHistory& coded_;
  const PositionGrid& grid_;
  std::vector<GridPoint> codes_;  // by vertex of the history, as merges leave them
  std::vector<VertexId> number_;  // by vertex of the history: its number here
  std::vector<glm::vec3> places_;
  std::vector<Face> faces_;
  std::vector<Range> around_;  // by vertex: its faces in around_pool_, gone ones among them
  std::vector<std::uint32_t> around_pool_;
  std::vector<std::uint32_t> member_;         // by vertex: the patch whose root it is or by which it is absorbed
  std::vector<std::uint32_t> patch_of_root_;  // by vertex: its last patch
  std::vector<std::uint32_t> patch_of_;       // by merge

  // Of a generation.
  std::uint32_t first_patch_ = 0;
  std::vector<VertexId> roots_;
  std::vector<VertexId> root_codes_;           // the roots in codes_
  std::vector<std::uint32_t> order_;           // by root
  std::vector<std::uint32_t> absorbed_begin_;  // by patch, into absorbed_
  std::vector<VertexId> absorbed_;

  // Of a patch.
  std::uint32_t patch_ = 0;
  VertexId root_ = 0;
  std::vector<std::uint32_t> covered_;
  std::vector<StarFace> rest_;
  std::vector<std::uint32_t> star_faces_;
  StarDistance star_;
  float extent_ = 0.0F;
};

}  // namespace fanstream
