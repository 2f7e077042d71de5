// What the patches of one generation cover and leave.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace fanstream {

// Patches share no face; neighbours follow each other. Faces are those of a PlacedMesh, places in grid steps.
struct GenerationStars {
  struct Patch {
    std::uint32_t number;       // counted on from generation to generation, in the order of their first merges
    glm::vec3 centre;           // where the root is afterwards
    std::uint32_t covered_end;  // into covered; the patch before it ends where this one begins
    std::uint32_t star_end;     // into star
    bool closed;                // the first face follows the last
    std::uint8_t parts;         // bit by part of the PlacedMesh: whether the covered faces may carry something of it
    bool concerns(std::uint32_t part) const { return (parts >> part & 1U) != 0; }
  };
  // A face that a patch leaves, between its root and an edge, seen from the root.
  struct StarFace {
    std::uint32_t face;
    glm::vec3 from, to;
  };

  std::uint32_t numbers_end = 0;  // patches of this and all finer generations
  std::vector<Patch> patches;
  std::vector<std::uint32_t> covered;  // faces, those that vanish among them
  std::vector<StarFace> star;          // in order around the root; an open star from its first face on

  std::span<const std::uint32_t> covered_by(std::size_t patch) const {
    const std::uint32_t begin = patch == 0 ? 0 : patches[patch - 1].covered_end;
    return std::span(covered).subspan(begin, patches[patch].covered_end - begin);
  }
  std::span<const StarFace> star_of(std::size_t patch) const {
    const std::uint32_t begin = patch == 0 ? 0 : patches[patch - 1].star_end;
    return std::span(star).subspan(begin, patches[patch].star_end - begin);
  }
  void clear() {
    patches.clear();
    covered.clear();
    star.clear();
  }
};

}  // namespace fanstream
