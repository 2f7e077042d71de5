// What coder and decoder both see of a root before it is split: its ring in space.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/coding/fan_vertex.h"
#include "common/fans/linked_fans.h"

namespace fanstream {

// A fan as it is linked: the vertices around it and the corners that spell them, eight entries for a fan of up to
// eight, else sixteen. Beyond the fan's end they go around again; of a fan longer than that they are the first.
struct FanWalk {
  static constexpr std::uint32_t kEntries = 16;
  std::uint32_t size = 0;  // of the fan
  alignas(16) std::array<VertexId, kEntries> ids;
  alignas(16) std::array<LinkedFans::CornerId, kEntries> corners;

  void go_around(const LinkedFans& fans, VertexId v) {
    size = fans.ring_size(v);
    const LinkedFans::CornerId at = go_eight(fans.corners(), fans.corner(v), 0);
    if (size > 8) go_eight(fans.corners(), at, 8);
  }
  // Several fans at once, step by step: each step waits for the memory's answer to the one before.
  template <std::size_t count>
  static void go_around(const LinkedFans& fans, const std::array<VertexId, count>& vertices,
                        const std::array<FanWalk*, count>& walks) {
    const LinkedFans::Corner* const all = fans.corners();
    std::array<LinkedFans::CornerId, count> at;
    for (std::size_t j = 0; j < count; ++j) {
      walks[j]->size = fans.ring_size(vertices[j]);
      at[j] = fans.corner(vertices[j]);
    }
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t j = 0; j < count; ++j) {
        const LinkedFans::Corner c = all[at[j]];
        walks[j]->ids[i] = c.neighbour;
        walks[j]->corners[i] = at[j];
        at[j] = c.next;
      }
    }
    for (std::size_t j = 0; j < count; ++j) {
      if (walks[j]->size > 8) walks[j]->go_eight(all, at[j], 8);
    }
  }

 private:
  LinkedFans::CornerId go_eight(const LinkedFans::Corner* all, LinkedFans::CornerId corner, std::size_t from) {
    for (std::size_t i = from; i < from + 8; ++i) {
      const LinkedFans::Corner c = all[corner];
      ids[i] = c.neighbour;
      corners[i] = corner;
      corner = c.next;
    }
    return corner;
  }
};

// All lengths are in grid steps, in single precision with plain IEEE operations only, so that
// every machine computes the same bits. Reused from split to split to avoid allocation; not thread safe.
class RingGeometry {
 public:
  // In three steps, so that several rings can be worked on side by side. First the ring of `root`, of at least 3.
  // Position 0 is where the fan starts (LinkedFans::corner), which its own splits alone determine.
  void load(const LinkedFans& fans, VertexId root);
  void load(const LinkedFans& fans, VertexId root, const FanWalk& walk);  // which has gone around the root
  // Then where it lies. `unit` is the size of one code step of each axis, 0 in the fourth lane.
  void place(std::span<const FanVertex> vertices, Float4 unit);
  // Then its shape.
  void measure();
  void assign(const LinkedFans& fans, VertexId root, std::span<const FanVertex> vertices, Float4 unit) {
    load(fans, root);
    place(vertices, unit);
    measure();
  }

  std::uint32_t size() const { return size_; }
  bool is_open() const { return gap_ < size_; }
  std::uint32_t gap() const { return gap_; }  // position of kOutside, or size()
  VertexId id(std::uint32_t i) const { return ids_[i]; }
  // The fan's corner that spells a position, and that before it.
  LinkedFans::CornerId corner(std::uint32_t i) const { return corners_[i]; }
  LinkedFans::CornerId corner_before(std::uint32_t i) const { return corners_[i + size_ - 1]; }
  // From the root; zero at the gap. Positions run on to 2 * size() - 1, twice around.
  Float4 spoke(std::uint32_t i) const { return spokes_[i]; }
  Float4 spoke_sum(std::uint32_t i) const { return spoke_sums_[i]; }  // of the first i, twice around
  Float4 normal() const { return normal_; }                           // unit length
  float mean_square() const { return mean_square_; }                  // of the spokes' lengths
  float bend_square() const {
    return bend_square_;
  }  // mean square of the ring's distances from the root's tangent plane
  std::uint32_t wrap(std::uint32_t i) const {
    return i - (size_ & (0U - static_cast<std::uint32_t>(i >= size_)));
  }                                                                  // of positions below 2 * size()
  std::uint32_t steps(std::uint32_t from, std::uint32_t to) const {  // without a branch, which would be a coin toss
    return to - from + (size_ & (0U - static_cast<std::uint32_t>(to < from)));
  }

  // For an arc of `length` ring steps, its possible first positions are ranked by how far the arc reaches out, since a
  // root that kept its place lies off the middle of its ring, away from the vertex it absorbed. Precondition: closed.
  std::uint32_t first_of_rank(std::uint32_t length, std::uint32_t rank) const;
  std::uint32_t rank_of_first(std::uint32_t length, std::uint32_t first) const;

 private:
  // Rings are worked on by blocks of four entries: two or four blocks, which the compiler unrolls, or as many as it
  // takes (0).
  template <std::uint32_t blocks>
  void lay_out(const FanWalk& walk);
  void lay_out_long(const LinkedFans& fans);
  void note(std::uint32_t at, Uint4 ids, Uint4& gap);
  void set_gap(Uint4 noted);
  template <std::uint32_t blocks>
  void place_blocks(std::span<const FanVertex> vertices, Float4 unit);
  template <std::uint32_t blocks>
  void measure_blocks();
  template <std::uint32_t blocks>
  std::uint32_t nth_reach(std::uint32_t length, std::uint32_t rank) const;
  template <std::uint32_t blocks>
  std::uint32_t block_count() const {
    return blocks != 0 ? blocks : (size_ + 3) / 4;
  }
  Float4 reach_block(std::uint32_t length, std::uint32_t at) const;
  void reaches(std::uint32_t length) const;
  void grow(std::size_t size);

  std::uint32_t size_ = 0;
  std::uint32_t gap_ = 0;
  VertexId root_ = 0;
  float mean_square_ = 0.0F;
  float bend_square_ = 0.0F;
  Float4 normal_{};  // before measure(): not yet of unit length
  std::size_t capacity_ = 0;
  std::vector<LinkedFans::CornerId> corners_;  // twice around
  std::vector<VertexId> ids_;
  std::vector<VertexId> neighbours_;    // the root itself at the gap and past the end
  std::vector<Float4> spokes_;          // twice around
  std::vector<Float4> spoke_sums_;      // of the first i spokes, twice around
  std::vector<float> square_sums_;      // of the first i spokes' squared lengths, twice around
  mutable std::vector<float> reaches_;  // scratch
};

}  // namespace fanstream
