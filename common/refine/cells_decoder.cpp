#include "common/refine/cells_decoder.h"

namespace fanstream {
namespace {

// The source of a decoder, which notes what undoing needs.
struct NotedSplits {
  FanState& state;

  void made(const SplitUndo& split, VertexId added) const { keep_undo(state, split, added); }
};

// Splits are gathered in coding.batch until it is full: whole batches of cells, each as the encoder coded it.
class CellsDecoder {
 public:
  CellsDecoder(FanState& state, std::uint32_t generation, CellCoding& coding)
      : state_(state), generation_(generation), coding_(coding), lattice_(state.precision.lattice(generation)) {
    coding.use_lattice(lattice_);
  }

  void run(std::span<CellToDecode> cells) {
    const std::size_t first = cells.front().roots_begin;
    do {
      for (CellToDecode& cell : cells) add_round(cell);
      flush();
      first_round_ = false;
    } while (keep_roots_left(cells, first));
  }

 private:
  // The next split of each of a cell's roots.
  void add_round(CellToDecode& cell) {
    std::size_t begin = cell.roots_begin;
    while (begin < cell.roots_end && cell.result) {
      const std::size_t size = std::min(CellCoding::kBatch, cell.roots_end - begin);
      if (gathered_ + size > CellCoding::kBatch) {
        flush();
      } else {
        add(cell, std::span<const CellCoding::Root>(coding_.roots).subspan(begin, size));
        begin += size;
      }
    }
  }

  void add(CellToDecode& cell, std::span<const CellCoding::Root> roots) {
    if (roots.size() > cell.vertices->most_new - cell.vertices->made) {
      cell.result = detail::too_many_splits(cell.vertices->cell);
      return;
    }
    const std::span<SplitInProgress> batch = std::span(coding_.batch).subspan(gathered_, roots.size());
    for (std::size_t i = 0; i < roots.size(); ++i) {
      batch[i].ring.load(state_.fans, roots[i].vertex, roots[i].walk);
      batch[i].split.root = roots[i].vertex;
    }
    if (first_round_ && !state_.precision.is_exact() &&
        !detail::refine_roots(state_, lattice_, cell.decoder, NotedSplits{state_}, batch)) {
      detail::coarsen_roots(state_, batch);
      cell.result = detail::off_the_grid(cell.vertices->cell, batch.front().split.root);
      return;
    }
    of_run_[runs_] = &cell;
    run_[runs_++] = {&cell.decoder, roots.size()};
    gathered_ += roots.size();
  }

  void flush() {
    if (gathered_ == 0) return;
    const std::span<SplitInProgress> batch = std::span(coding_.batch).first(gathered_);
    decode_splits(std::span(run_).first(runs_), coding_.model, coding_.lattice_units,
                  {generation_, coding_.last_generation}, batch, {state_.vertices.data(), coding_.units.size},
                  coding_.kernels);
    std::size_t begin = 0;
    const NotedSplits source{state_};
    for (std::size_t r = 0; r < runs_; ++r) {
      CellToDecode& cell = *of_run_[r];
      const std::span<SplitInProgress> of_cell = batch.subspan(begin, run_[r].splits);
      if (!lattice_.is_exact()) detail::code_lasting_low_bits(cell.decoder, state_.precision, generation_, of_cell);
      cell.result = detail::apply_batch(state_, *cell.vertices, generation_, of_cell, source, coding_);
      begin += of_cell.size();
    }
    gathered_ = 0;
    runs_ = 0;
  }

  // Those that are split once more. Returns whether there are any.
  bool keep_roots_left(std::span<CellToDecode> cells, std::size_t first) {
    std::size_t left = first;
    for (CellToDecode& cell : cells) {
      const std::size_t begin = left;
      for (std::size_t r = cell.roots_begin; r < cell.roots_end && cell.result; ++r) {
        const VertexId v = coding_.roots[r].vertex;
        coding_.roots[left].vertex = v;
        left += state_.vertices[v].context.next == generation_ ? 1 : 0;
      }
      cell.roots_begin = begin;
      cell.roots_end = left;
    }
    coding_.root_count = left;
    go_around_roots(state_, coding_, first);
    coding_.root_count = first;
    return left != first;
  }

  FanState& state_;
  const std::uint32_t generation_;
  CellCoding& coding_;
  const PlaceLattice& lattice_;
  bool first_round_ = true;
  std::size_t gathered_ = 0;  // splits
  std::size_t runs_ = 0;
  std::array<DecoderRun, CellCoding::kBatch> run_;
  std::array<CellToDecode*, CellCoding::kBatch> of_run_;
};

}  // namespace

void decode_generation(FanState& state, std::uint32_t generation, std::span<CellToDecode> cells, CellCoding& coding) {
  if (!cells.empty()) CellsDecoder(state, generation, coding).run(cells);
}

}  // namespace fanstream
