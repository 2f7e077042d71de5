#include "server/build/merged_ring.h"

#include <glm/geometric.hpp>

namespace fanstream {

void MergedRing::assign(const RingMesh& rings, VertexId root, VertexId removed) {
  const auto root_ring = rings.ring(root);
  const auto removed_ring = rings.ring(removed);
  arc_ = removed_ring.size() - 2;
  ids_.resize(removed_ring.size() + root_ring.size() - 4);
  std::size_t filled = 0;
  const auto add_after = [&](std::span<const VertexId> ring, std::size_t at, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      if (++at == ring.size()) at = 0;
      ids_[filled++] = ring[at];
    }
  };
  add_after(removed_ring, rings.position_in_ring(removed, root), removed_ring.size() - 1);
  const std::uint32_t last_wing = rings.position_in_ring(root, ids_[arc_]);
  add_after(root_ring, last_wing, root_ring.size() - 3);
}

bool MergedRing::is_mergeable(const RingMesh& rings) const {
  if (size() < 3) return false;
  const VertexId wings[] = {ids_[0], ids_[arc_]};
  if (wings[0] == kOutside && wings[1] == kOutside) return false;
  for (const VertexId wing : wings) {
    if (wing != kOutside && rings.ring_size(wing) <= 3) return false;
  }
  // The ends have their wings in common, and nothing else: all others in the merged ring differ.
  for (std::size_t i = 1; i < arc_; ++i) {
    for (std::size_t j = arc_ + 1; j < ids_.size(); ++j) {
      if (ids_[i] == ids_[j]) return false;
    }
  }
  return true;
}

void MergedRing::assign_places(std::span<const glm::dvec3> places) {
  gap_ = ids_.size();
  places_.resize(ids_.size());
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    if (ids_[i] == kOutside) {
      gap_ = i;
    } else {
      places_[i] = places[ids_[i]];
    }
  }
}

bool MergedRing::faces_keep(std::size_t first, std::size_t end, const glm::dvec3& from, const glm::dvec3& to,
                            double least_cosine) const {
  for (std::size_t i = first; i < end; ++i) {
    const std::size_t next = i + 1 == size() ? 0 : i + 1;
    if (i == gap_ || next == gap_) continue;
    const glm::dvec3& v = places_[i];
    const glm::dvec3 side = places_[next] - v;
    const glm::dvec3 before = glm::cross(side, from - v);
    const glm::dvec3 after = glm::cross(side, to - v);
    const double before2 = glm::dot(before, before);
    if (before2 == 0.0) continue;
    const double d = glm::dot(before, after);
    if (d <= 0.0 || d * d < least_cosine * least_cosine * before2 * glm::dot(after, after)) return false;
  }
  return true;
}

MergedRing::CodingEffort MergedRing::coding_effort(const glm::dvec3& root_place, const glm::dvec3& removed_place,
                                                   const glm::dvec3& target) {
  const std::size_t size = ids_.size();
  squares_.resize(2 * size);
  double mean_square = 0.0;
  glm::dvec3 middle = root_place;
  double neighbours = 1.0;
  for (std::size_t i = 0; i < size; ++i) {
    squares_[i] = 0.0;
    if (i != gap_) {
      const glm::dvec3 spoke = places_[i] - target;
      squares_[i] = glm::dot(spoke, spoke);
    }
    squares_[size + i] = squares_[i];
    mean_square += squares_[i] / static_cast<double>(size);
    if (i > arc_ || i == gap_) continue;
    middle += places_[i];
    neighbours += 1.0;
  }
  CodingEffort effort;
  if (!is_open()) {
    const auto reach = [&](std::size_t first) {
      double sum = -0.4 * (squares_[first] + squares_[first + arc_]);
      for (std::size_t i = 1; i < arc_; ++i) sum += squares_[first + i];
      return sum;
    };
    const double own = reach(0);
    for (std::size_t first = 1; first < size; ++first) effort.rank += reach(first) > own ? 1 : 0;
  }
  const glm::dvec3 off = removed_place - middle / neighbours;
  effort.off_middle = mean_square > 0.0 ? glm::dot(off, off) / mean_square : 0.0;
  return effort;
}

}  // namespace fanstream
