// The star that a patch leaves, for those who measure distances from it.
#pragma once

#include "server/build/generation_stars.h"
#include "server/build/star_distance.h"

namespace fanstream {

class PatchStar {
 public:
  void assign(const GenerationStars& stars, std::size_t patch) {
    const GenerationStars::Patch& from = stars.patches[patch];
    centre_ = from.centre;
    star_ = stars.star_of(patch);
    distance_.clear();
    extent_ = 0.0F;
    for (const GenerationStars::StarFace& f : star_) {
      reach(f.from);
      reach(f.to);
      distance_.add(f.from, f.to);
    }
    distance_.finish(from.closed);
  }

  const glm::vec3& centre() const { return centre_; }
  const StarDistance& distance() const { return distance_; }  // around centre()
  std::uint32_t count() const { return static_cast<std::uint32_t>(star_.size()); }
  std::uint32_t face(std::uint32_t i) const { return star_[i].face; }
  // The edge from the centre between a face of the star and the next.
  const glm::vec3& edge_after(std::uint32_t i) const { return star_[i].to; }
  float extent() const { return extent_; }  // the largest coordinate of a corner, seen from the centre

 private:
  void reach(const glm::vec3& p) { extent_ = std::max({extent_, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}); }

  glm::vec3 centre_{0.0F};
  std::span<const GenerationStars::StarFace> star_;
  StarDistance distance_;
  float extent_ = 0.0F;
};

}  // namespace fanstream
