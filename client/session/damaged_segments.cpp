#include "client/session/damaged_segments.h"

#include <iterator>

namespace fanstream {

void DamagedSegments::add(const MeshMove::Damage& damage) {
  messages_.insert_or_assign({damage.cell, damage.segment}, damage.error.message);
}

void DamagedSegments::forget(std::span<const CellRun> released) {
  for (const CellRun& run : released) {
    const auto end = messages_.lower_bound({run.first_cell + run.cell_count, 0});
    for (auto found = messages_.lower_bound({run.first_cell, 0}); found != end;) {
      found = found->first.second >= run.prefix ? messages_.erase(found) : std::next(found);
    }
  }
}

}  // namespace fanstream
