// The mesh between the generations of a history, fine to coarse: what each of its patches covers and leaves.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "server/build/coded_history.h"
#include "server/build/generation_stars.h"
#include "server/build/placed_mesh.h"

namespace fanstream {

// Faces keep their number as long as they exist: one with a single corner among the vertices that a patch merges stays,
// with the root in that corner's place; those with two or three vanish. Keeps references to its arguments. Not thread
// safe.
class PatchReplay {
 public:
  PatchReplay(const PlacedMesh& mesh, const CodedHistory& coded);

  // Replays all generations. For each, calls follow(stars, i) for every i below `followers`: on several threads for a
  // large model, so those of one generation must not depend on each other; all have returned before the next
  // generation's are called. Call once.
  void run(std::size_t followers, const std::function<void(const GenerationStars&, std::size_t)>& follow);

  // By merge: the number of its patch.
  const std::vector<std::uint32_t>& patch_of_merge() const { return patch_of_; }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  struct Face {
    VertexId corners[3];
    std::uint32_t covered_by = kNone;  // the last patch that has
    std::uint8_t parts = 0;            // GenerationStars::Patch::parts
    bool is_gone() const { return corners[0] == kNone; }
  };
  struct StarFace {
    std::uint32_t face;
    VertexId from, to;
  };

  bool replay_next(GenerationStars& stars);
  void gather_patches(std::uint32_t k);
  void gather_absorbed(std::uint32_t begin, std::uint32_t end);
  void cover(std::uint32_t p, GenerationStars& stars);
  void cover_around(VertexId v, GenerationStars& stars);
  void leave_star(std::span<const std::uint32_t> covered, GenerationStars& stars);
  void order_rest();
  void fetch(std::size_t at) const;

  const PlacedMesh& mesh_;
  const CodedHistory& coded_;
  std::uint32_t generation_ = 0;
  std::vector<GridPoint> codes_;  // by vertex of the history, as merges leave them
  std::vector<glm::vec3> places_;
  std::vector<Face> faces_;
  FacesAround around_;                        // gone ones among them
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
  std::vector<StarFace> rest_;
};

}  // namespace fanstream
