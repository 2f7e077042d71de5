// What a view makes of all cells, kept from plan to plan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/view/cell_table.h"
#include "client/view/criteria.h"

namespace fanstream {

// The judgements of one view on the cells whose extents are known, at half their size: in single precision, errors
// rounded to what is no better. A cell without counts as lying anywhere in its parent, and one of slab 0 as lying
// anywhere. Not thread safe.
class KeptJudgements {
 public:
  explicit KeptJudgements(const CellTable& table) : table_(table) {}  // which must outlive it

  const CellTable& table() const { return table_; }

  // To be called first, when the view or the extents that are known have changed. `anywhere`: ViewJudge's.
  void begin(const CellJudgement& anywhere);
  // Precondition: the cell's extent is known.
  void set(std::uint32_t cell, const CellJudgement& judgement);
  // Precondition: the extent has been judged, if it is known; else those of the cells that it comes from.
  CellJudgement operator[](std::uint32_t cell) const {
    return table_.extent_known(cell) ? judged(cell) : within_parent(cell);
  }

 private:
  struct Kept {
    float scale_px = 0.0F;
    float depth = 0.0F;
    float slant = 0.0F;
    float weight = 1.0F;
    float weight_within = 1.0F;
    float area_px = 0.0F;
    bool in_frustum = true;
    Facing facing = Facing::unknown;
  };
  CellJudgement judged(std::uint32_t cell) const {
    const Kept& kept = kept_[table_.extent_number(cell)];
    return {{kept.scale_px, kept.depth, kept.slant, anywhere_.error.near},
            kept.weight,
            kept.weight_within,
            kept.area_px,
            kept.in_frustum,
            kept.facing};
  }
  CellJudgement within_parent(std::uint32_t cell) const;

  const CellTable& table_;
  std::vector<Kept> kept_;  // by CellTable::extent_number
  CellJudgement anywhere_;
};

// For going through cells in order: children of one cell that have no extents are judged once.
class JudgementWalk {
 public:
  explicit JudgementWalk(const KeptJudgements& judgements) : judgements_(judgements), table_(judgements.table()) {}
  // Valid until the next call.
  const CellJudgement& operator()(std::uint32_t cell) {
    const bool known = table_.extent_known(cell);
    if (known || !within_ || table_.parent(cell) != parent_) judgement_ = judgements_[cell];
    within_ = !known;
    parent_ = table_.parent(cell);
    return judgement_;
  }

 private:
  const KeptJudgements& judgements_;
  const CellTable& table_;
  CellJudgement judgement_;
  bool within_ = false;  // it is that of a cell of parent_ without extent
  std::uint32_t parent_ = 0;
};

}  // namespace fanstream
