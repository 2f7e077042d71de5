#include "common/refine/cell_coder.h"

namespace fanstream::detail {

Result<void> too_many_splits(std::uint32_t cell) {
  return fail(ErrorKind::bad_input,
              "cell " + std::to_string(cell) + ": its vertices are split more often than the cell table allows");
}

Result<void> off_the_grid(std::uint32_t cell, VertexId root) {
  return fail(ErrorKind::bad_input,
              "cell " + std::to_string(cell) + ": the split of vertex " + std::to_string(root) + " leaves the grid");
}

}  // namespace fanstream::detail
