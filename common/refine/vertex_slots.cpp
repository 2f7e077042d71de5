#include "common/refine/vertex_slots.h"

#include <algorithm>

namespace fanstream {

std::vector<VertexSlots::Range> VertexSlots::take_emptied() {
  constexpr std::size_t kReach = 1024 / kGroup;  // a page of the smallest elements, FanState::cells
  std::vector<std::uint32_t> emptied = std::exchange(emptied_, {});
  std::sort(emptied.begin(), emptied.end());
  std::vector<Range> ranges;
  std::size_t end = 0;  // of what has been looked at
  for (const std::uint32_t group : emptied) {
    if (group < end || used_[group] != 0) continue;
    std::size_t begin = group;
    const std::size_t low = std::max<std::size_t>(end, group - std::min<std::size_t>(group, kReach));
    const std::size_t high = std::min(used_.size(), group + std::size_t{1} + kReach);
    while (begin > low && used_[begin - 1] == 0) --begin;
    for (end = group + std::size_t{1}; end < high && used_[end] == 0;) ++end;
    if (!ranges.empty() && ranges.back().last == range(begin, end).first) {
      ranges.back().last = range(begin, end).last;
    } else {
      ranges.push_back(range(begin, end));
    }
  }
  return ranges;
}

}  // namespace fanstream
