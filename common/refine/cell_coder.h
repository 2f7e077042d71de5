// One generation of one cell, to symbols and back.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "common/coding/split_coder.h"
#include "common/grid/position_grid.h"
#include "common/refine/cell_vertices.h"
#include "common/refine/fan_state.h"
#include "common/support/result.h"

namespace fanstream {

// The scratch and constants that coding needs; one per thread of work.
struct CellCoding {
  static constexpr std::size_t kBatch = 16;  // splits that are coded side by side at most: part of the format
  struct Root {
    VertexId vertex = 0;
    FanWalk walk;  // before its first split
    Root() {}      // NOLINT: like a walk
  };
  const SplitModel& model;
  const PositionGrid& grid;
  Int4 last_codes;          // the largest of each axis; of no axis in the fourth lane
  AxisUnits units;          // of codes
  AxisUnits lattice_units;  // of the lattice of the generation at hand
  const RingKernels& kernels = RingKernels::best();
  std::uint32_t last_generation;  // of the asset
  std::array<SplitInProgress, kBatch> batch;
  std::vector<Root> roots;  // the first root_count: those of one generation of a cell behind those of another
  std::size_t root_count = 0;

  CellCoding(const SplitModel& split_model, const PositionGrid& position_grid, std::uint32_t generation_count)
      : model(split_model),
        grid(position_grid),
        last_codes{grid.code_count(0) - 1, grid.code_count(1) - 1, grid.code_count(2) - 1,
                   std::numeric_limits<std::int32_t>::max()},
        units(grid.unit()),
        lattice_units(units),
        last_generation(generation_count) {}

  void use_lattice(const PlaceLattice& lattice) {
    lattice_units = lattice.is_exact() ? units : AxisUnits(grid.unit() * lattice.cell_size());
  }
};

// Puts the cell's vertices that are split in a generation behind coding.roots, all coarser generations of the cell
// having been applied.
inline void add_roots(const FanState& state, const CellVertices& vertices, std::uint32_t generation,
                      CellCoding& coding) {
  constexpr std::uint32_t kBlock = 256;  // of vertices, which may all be roots: room for them is made first
  std::size_t count = coding.root_count;
  const auto look_at = [&](std::uint32_t size, const auto& vertex_at) {
    for (std::uint32_t begin = 0; begin < size; begin += kBlock) {
      if (coding.roots.size() < count + kBlock) coding.roots.resize(2 * (count + kBlock));
      CellCoding::Root* const roots = coding.roots.data();
      for (std::uint32_t i = begin; i < std::min(size, begin + kBlock); ++i) {
        const VertexId v = vertex_at(i);
        roots[count].vertex = v;
        count += state.vertices[v].context.next == generation ? 1 : 0;
      }
    }
  };
  look_at(vertices.initial.size(), [at = vertices.initial.data()](std::uint32_t i) { return at[i]; });
  if (vertices.slots.empty()) {
    look_at(vertices.made, [first = vertices.first_new](std::uint32_t i) { return first + i; });
  } else {
    look_at(vertices.made, [at = vertices.slots.data()](std::uint32_t i) { return at[i]; });
  }
  coding.root_count = count;
}

// Goes around the roots from number `first` on.
inline void go_around_roots(const FanState& state, CellCoding& coding, std::size_t first) {
  constexpr std::size_t kTogether = 4;
  std::size_t i = first;
  for (; i + kTogether <= coding.root_count; i += kTogether) {
    CellCoding::Root* const r = coding.roots.data() + i;
    FanWalk::go_around<kTogether>(state.fans, {r[0].vertex, r[1].vertex, r[2].vertex, r[3].vertex},
                                  {&r[0].walk, &r[1].walk, &r[2].walk, &r[3].walk});
  }
  for (; i < coding.root_count; ++i) coding.roots[i].walk.go_around(state.fans, coding.roots[i].vertex);
}

// Whether a vertex around a root of a generation, which has been gone around, still has to be split in a coarser one.
// Without branches on what is found, nor on the size of common fans.
inline bool lags(const FanState& state, std::uint32_t generation, const CellCoding::Root& root) {
  std::uint32_t below = 0;
  const FanVertex* const vertices = state.vertices.data();
  const auto look = [&](VertexId w) { below |= vertices[w == kOutside ? root.vertex : w].context.next - generation; };
  const FanWalk& walk = root.walk;
  if (walk.size > FanWalk::kEntries) [[unlikely]] {
    state.fans.for_each_neighbour(root.vertex, look);
  } else {
    for (std::size_t k = 0; k < 8; ++k) look(walk.ids[k]);
    for (std::size_t k = 8; k < walk.size; ++k) look(walk.ids[k]);
  }
  return static_cast<std::int32_t>(below) < 0;
}

// Returns kOutside if a root of a generation, which has been gone around, has all its neighbours as the encoder saw
// them, and so it stays until it is split; else a vertex, of another cell, that still has to be split in a coarser
// generation.
inline VertexId find_lagging(const FanState& state, std::uint32_t generation, const CellCoding::Root& root) {
  VertexId lagging = kOutside;
  if (!lags(state, generation, root)) [[likely]]
    return lagging;
  state.fans.for_each_neighbour(root.vertex, [&](VertexId w) {
    if (state.vertices[w].context.next < generation) lagging = w;
  });
  return lagging;
}

// All of that: kOutside if none of the roots lags, which is so where all cells go through the generations in step.
inline VertexId find_roots(const FanState& state, const CellVertices& vertices, std::uint32_t generation,
                           CellCoding& coding) {
  const std::size_t first = coding.root_count;
  add_roots(state, vertices, generation, coding);
  go_around_roots(state, coding, first);
  VertexId lagging = kOutside;
  for (std::size_t i = first; i < coding.root_count && lagging == kOutside; ++i) {
    lagging = find_lagging(state, generation, coding.roots[i]);
  }
  return lagging;
}

namespace detail {

// Kept out of the way of what is decoded.
[[gnu::cold, gnu::noinline]] Result<void> too_many_splits(std::uint32_t cell);
[[gnu::cold, gnu::noinline]] Result<void> off_the_grid(std::uint32_t cell, VertexId root);

// The low bits of the roots' places that the generation's lattice has and what is known does not; from here on the
// roots lie where the lattice has them.
template <class Coder, class Source>
bool refine_roots(FanState& state, const PlaceLattice& lattice, Coder& coder, const Source& source,
                  std::span<const SplitInProgress> batch) {
  auto&& fast = fast_coder(coder);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    FanVertex& root = state.vertices[batch[i].split.root];
    const PlaceLattice& known = state.precision.known(root.context.touched, root.context.next);
    if (known.left_out == lattice.left_out) continue;  // it lies there already
    const LatticeStep step(known, lattice);
    LowBits low = 0;
    if constexpr (!Coder::kDecodes) low = source.root_low_bits(batch[i].split.root);
    const GridPoint point = step.fine(known.point_of(root.place), step.code(fast, low));
    if (!lattice.contains(point)) return false;
    root.place = lattice.code_of(point);
  }
  return true;
}

// As before refine_roots, of roots that were not split after all.
inline void coarsen_roots(FanState& state, std::span<const SplitInProgress> batch) {
  if (state.precision.is_exact()) return;
  for (const SplitInProgress& s : batch) {
    FanVertex& root = state.vertices[s.split.root];
    root.place = state.precision.shown(root.place, root.context);
  }
}

// Of those that are known better afterwards than on the generation's lattice, what that leaves out.
template <class Coder>
void code_lasting_low_bits(Coder& coder, const PlacePrecision& precision, std::uint32_t generation,
                           std::span<SplitInProgress> batch) {
  const PlaceLattice& lattice = precision.lattice(generation);
  auto&& fast = fast_coder(coder);
  const auto code = [&](std::uint8_t next, LowBits& low) {
    const PlaceLattice& known = precision.known(generation, next);
    if (known.left_out == lattice.left_out) return;
    low = LatticeStep(lattice, known).code(fast, low);
  };
  for (SplitInProgress& s : batch) {
    code(s.root_next, s.kept_low);
    code(s.added_next, s.added_low);
  }
}

// What is known of the places after a split, where the generation's lattice leaves bits out. False where they leave the
// grid.
inline bool find_coarse_places(const SplitInProgress& s, const GridPoint& parent, std::uint32_t generation,
                               const PlacePrecision& precision, SplitLanes& places) {
  const PlaceLattice& lattice = precision.lattice(generation);
  const SplitPlaces points =
      places_after_split(lattice.point_of(parent), s.split.parent, s.split.displacement, generation, s.split.shift);
  if (!lattice.contains(points.kept) || !lattice.contains(points.added)) return false;
  bool within = true;
  const auto place = [&](GridPoint point, std::uint8_t next, LowBits low) {
    const PlaceLattice& known = precision.known(generation, next);
    if (known.left_out != lattice.left_out) point = LatticeStep(lattice, known).fine(point, low);
    within = within && known.contains(point);
    return int4(known.code_of(point));
  };
  places = {place(points.kept, s.root_next, s.kept_low), place(points.added, s.added_next, s.added_low)};
  return within;
}

// The same on any lattice.
inline bool find_places(const SplitInProgress& s, const FanVertex& parent, std::uint32_t generation,
                        const PlacePrecision& precision, Int4 last_codes, SplitLanes& places) {
  if (precision.lattice(generation).is_exact()) [[likely]] {
    places = places_after_split(parent.place4(), s.split.parent, int4(s.split.displacement), generation, s.split.shift);
  } else if (!find_coarse_places(s, parent.place, generation, precision, places)) {
    return false;
  }
  const Int4 outside = (places.kept | (last_codes - places.kept)) | (places.added | (last_codes - places.added));
  return !any_negative(outside) && (s.split.parent != ParentPosition::free || is_shift(s.split.shift));
}

// Splits of a cell that have been coded.
template <class Source>
Result<void> apply_batch(FanState& state, CellVertices& vertices, std::uint32_t generation,
                         std::span<const SplitInProgress> batch, Source& source, const CellCoding& coding) {
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const SplitInProgress& s = batch[i];
    const VertexId v = s.split.root;
    SplitLanes places;
    if (!find_places(s, state.vertices[v], generation, state.precision, coding.last_codes, places)) {
      coarsen_roots(state, batch.subspan(i));
      return off_the_grid(vertices.cell, v);
    }
    const VertexId added = vertices.add(state);
    const SplitUndo undo{v, state.fans.corner(v), state.vertices[v].context, s.split.parent, s.split.shift};
    const LinkedFans::Arc arc = s.ring.arc(s.split.first, s.split.last);
    apply_split(state, vertices.cell, generation, v, arc, places, {s.root_next, s.added_next}, added);
    source.made(undo, added);
  }
  return {};
}

// The next split of up to kBatch roots.
template <class Coder, class Source>
Result<void> code_batch(FanState& state, CellVertices& vertices, std::uint32_t generation,
                        std::span<const CellCoding::Root> roots, bool first_round, Coder& coder, Source& source,
                        CellCoding& coding) {
  if (roots.size() > vertices.most_new - vertices.made) return too_many_splits(vertices.cell);
  const std::span<SplitInProgress> batch = std::span(coding.batch).first(roots.size());
  for (std::size_t i = 0; i < roots.size(); ++i) {
    const VertexId v = roots[i].vertex;
    if (first_round) {
      batch[i].ring.load(state.fans, v, roots[i].walk);
    } else {
      batch[i].ring.load(state.fans, v);
    }
    batch[i].split.root = v;
  }
  const PlaceLattice& lattice = state.precision.lattice(generation);
  if (first_round && !state.precision.is_exact() && !refine_roots(state, lattice, coder, source, batch)) {
    coarsen_roots(state, batch);
    return off_the_grid(vertices.cell, batch.front().split.root);
  }
  const RingPlaces places_now{state.vertices.data(), coding.units.size};
  for (SplitInProgress& s : batch) {
    if constexpr (!Coder::kDecodes) coding.kernels.measure(s.ring, places_now);
    source.describe(s);
  }
  code_splits(coder, coding.model, coding.lattice_units, {generation, coding.last_generation}, batch, places_now,
              coding.kernels);
  if (!lattice.is_exact()) code_lasting_low_bits(coder, state.precision, generation, batch);
  return apply_batch(state, vertices, generation, batch, source, coding);
}

}  // namespace detail

// Codes and applies the splits of the roots from number `first_root` on, which have been gone around with none lagging,
// and takes them off coding.roots. Source is what knows the splits: for an encoder the builder's history, for a decoder
// what notes them. It has
//   void describe(SplitInProgress&), which for an encoder fills in the split of split.root, when both vertices are
//   split next, and what is known of their places beyond the lattice; a decoder's may look at the ring, which is not
//   measured yet; and for an encoder LowBits root_low_bits(VertexId root), those of its place that the generation's
//   lattice has and are not known yet,
// and is told made(const SplitUndo&, VertexId added) of each split. Splits come in rounds: the first of every root,
// then the second of those that have two, and so on; a root's next one is asked for after the one before was made.
// `generation` counts from 1. Fails, leaving the mesh valid but useless, if decoded splits leave the grid or outnumber
// the cell table's.
template <class Coder, class Source>
Result<void> code_generation(FanState& state, CellVertices& vertices, std::uint32_t generation, Coder& coder,
                             Source& source, CellCoding& coding, std::size_t first_root = 0) {
  std::span<CellCoding::Root> roots = std::span(coding.roots).first(coding.root_count).subspan(first_root);
  coding.use_lattice(state.precision.lattice(generation));
  coding.root_count = first_root;
  for (std::uint32_t round = 0; !roots.empty(); ++round) {
    for (std::size_t begin = 0; begin < roots.size(); begin += CellCoding::kBatch) {
      const std::size_t size = std::min(CellCoding::kBatch, roots.size() - begin);
      const std::span<const CellCoding::Root> some = roots.subspan(begin, size);
      if (Result<void> coded = detail::code_batch(state, vertices, generation, some, round == 0, coder, source, coding);
          !coded)
        return coded;
    }
    std::size_t left = 0;  // the walks are of no more use
    for (const CellCoding::Root& r : roots) {
      roots[left].vertex = r.vertex;
      left += state.vertices[r.vertex].context.next == generation ? 1 : 0;
    }
    roots = roots.first(left);
  }
  return {};
}

}  // namespace fanstream
