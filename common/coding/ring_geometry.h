// What coder and decoder both see of a root before it is split: its ring in space.
#pragma once

#include <algorithm>
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
  alignas(32) std::array<VertexId, kEntries> ids;
  alignas(32) std::array<LinkedFans::CornerId, kEntries> corners;

  FanWalk() {}  // NOLINT: not defaulted, so that entries are not set to zero where many are made

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

// What rings are measured in: the mesh's vertices by number, and the size of one code step of each axis, 0 in the
// fourth lane.
struct RingPlaces {
  const FanVertex* vertices = nullptr;
  Float4 unit{};
};

// All lengths are in grid steps, in single precision with plain IEEE operations only, so that every machine computes
// the same bits. The numbers are kept component by component, in blocks of eight that ring_kernels.h works on. Reused
// from split to split to avoid allocation; not thread safe.
class RingGeometry {
 public:
  RingGeometry() = default;
  RingGeometry(const LinkedFans& fans, VertexId root, std::span<const FanVertex> vertices, Float4 unit) {
    assign(fans, root, vertices, unit);
  }
  RingGeometry(const RingGeometry&) = delete;
  RingGeometry& operator=(const RingGeometry&) = delete;

  // In two steps, so that several rings can be worked on side by side. First the ring of `root`, of at least 3.
  // Position 0 is where the fan starts (LinkedFans::corner), which its own splits alone determine.
  void load(const LinkedFans& fans, VertexId root);
  // By a walk that has gone around the root, which is to be kept as long as the ring is in use.
  void load(const LinkedFans& fans, VertexId root, const FanWalk& walk) {
    size_ = walk.size;
    root_ = root;
    walk_ = &walk;
    if (is_short()) [[likely]] {
      keep_corners(0);
      if (size_ > 8) keep_corners(8);
    } else {
      load_long(fans);
    }
  }
  // Then where it lies, and its shape. `unit` is the size of one code step of each axis, 0 in the fourth lane.
  void measure(std::span<const FanVertex> vertices, Float4 unit);
  void assign(const LinkedFans& fans, VertexId root, std::span<const FanVertex> vertices, Float4 unit) {
    load(fans, root);
    measure(vertices, unit);
  }

  VertexId root() const { return root_; }
  std::uint32_t size() const { return size_; }
  bool is_open() const { return gap_ < size_; }
  std::uint32_t gap() const { return gap_; }  // position of kOutside, or size()
  VertexId id(std::uint32_t i) const { return ids()[i]; }
  // The fan's corner that spells a position.
  LinkedFans::CornerId corner(std::uint32_t i) const { return corners()[i]; }
  // For LinkedFans::split, as long as the ring is as it was loaded.
  LinkedFans::Arc arc(std::uint32_t first, std::uint32_t last) const {
    return {corners() + first, backs() + first, size_, steps(first, last)};
  }
  // From the root; zero at the gap.
  Float4 spoke(std::uint32_t i) const { return Float4{xs()[i], ys()[i], zs()[i], 0.0F}; }
  Float4 normal() const { return normal_; }           // unit length
  float mean_square() const { return mean_square_; }  // of the spokes' lengths
  float bend_square() const { return bend_square_; }  // mean square of distances from the root's tangent plane
  std::uint32_t wrap(std::uint32_t i) const {         // of positions below 2 * size()
    return i - (size_ & (0U - static_cast<std::uint32_t>(i >= size_)));
  }
  std::uint32_t steps(std::uint32_t from, std::uint32_t to) const {  // without a branch, which would be a coin toss
    return to - from + (size_ & (0U - static_cast<std::uint32_t>(to < from)));
  }

  // For an arc of `length` ring steps, its possible first positions are ranked by how far the arc reaches out, since a
  // root that kept its place lies off the middle of its ring, away from the vertex it absorbed. Precondition: closed.
  std::uint32_t first_of_rank(std::uint32_t length, std::uint32_t rank) const;
  std::uint32_t rank_of_first(std::uint32_t length, std::uint32_t first) const;

  // --- For the kernels ---

  static constexpr std::uint32_t kShort = FanWalk::kEntries;  // of longer rings the numbers are kept elsewhere
  std::uint32_t block_count() const { return (size_ + 7) / 8; }
  // By position. Of what lies beyond the ring's end, up to that of a block, spokes are zero and nobody is split; ids
  // are of any vertex, or kOutside. A short ring's spokes are zero up to kShort.
  const VertexId* ids() const { return is_short() ? walk_->ids.data() : long_ids_.data(); }
  // Twice around, and back_of each of them.
  const LinkedFans::CornerId* corners() const { return is_short() ? short_.corners.data() : ids() + stride(); }
  const LinkedFans::CornerId* backs() const { return is_short() ? short_.backs.data() : ids() + 3 * stride(); }
  const float* xs() const { return is_short() ? short_.x.data() : long_numbers_.data(); }
  const float* ys() const { return is_short() ? short_.y.data() : xs() + stride(); }
  const float* zs() const { return is_short() ? short_.z.data() : xs() + 2 * stride(); }
  // The sums of the first i squared lengths of spokes, twice around.
  const float* square_sums() const { return is_short() ? short_.square_sums.data() : xs() + 3 * stride(); }
  // The generations in which the ring's vertices are split next.
  const std::uint32_t* nexts() const { return is_short() ? short_.nexts.data() : ids() + 5 * stride(); }
  struct Places {
    float *x, *y, *z, *square_sums;
    std::uint32_t* nexts;
  };
  Places places() {
    return {const_cast<float*>(xs()), const_cast<float*>(ys()), const_cast<float*>(zs()),
            const_cast<float*>(square_sums()), const_cast<std::uint32_t*>(nexts())};
  }
  void set_gap(std::uint32_t gap) { gap_ = gap; }
  // Of cross products and, in the fourth lane, of squared lengths; kept in the normal's place until that is known.
  void set_sums(Float4 sums) { normal_ = sums; }
  Float4 sums() const { return normal_; }
  void set_measures(Float4 normal, float mean_square, float bend_square) {
    normal_ = normal;
    mean_square_ = mean_square;
    bend_square_ = bend_square;
  }

 private:
  // Written by whole blocks, the sums twice around and a block further.
  struct Short {
    alignas(32) std::array<LinkedFans::CornerId, 2 * kShort> corners, backs;
    alignas(32) std::array<std::uint32_t, kShort> nexts;
    alignas(32) std::array<float, kShort> x, y, z;
    alignas(32) std::array<float, 2 * kShort + 16> square_sums;
  };

  bool is_short() const { return size_ <= kShort; }
  std::size_t stride() const { return std::size_t{8} * block_count(); }
  void load_long(const LinkedFans& fans);
  // Eight corners of the walk, where they come first and a ring further on. What lies beyond the ring's end there goes
  // around again, too.
  void keep_corners(std::uint32_t from) {
    for (std::uint32_t i = from; i < from + 8; i += 4) {
      const Uint4 corners = load4(walk_->corners.data() + i);
      const Uint4 is_first = mask_of((corners & uint4(3)) == uint4(0));
      const Uint4 backs = corners + (is_first & uint4(3)) - uint4(1);
      store4(short_.corners.data() + i, corners);
      store4(short_.corners.data() + size_ + i, corners);
      store4(short_.backs.data() + i, backs);
      store4(short_.backs.data() + size_ + i, backs);
    }
  }

  std::uint32_t size_ = 0;
  std::uint32_t gap_ = 0;
  VertexId root_ = 0;
  float mean_square_ = 0.0F;
  float bend_square_ = 0.0F;
  Float4 normal_{};
  const FanWalk* walk_ = nullptr;
  Short short_;
  FanWalk own_walk_;
  std::vector<std::uint32_t> long_ids_;  // ids, corners, backs, nexts
  std::vector<float> long_numbers_;      // x, y, z, square sums
};

}  // namespace fanstream
