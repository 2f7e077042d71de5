// One generation of several cells, from their streams, side by side.
#pragma once

#include <span>

#include "common/refine/cell_coder.h"

namespace fanstream {

// Of a cell whose roots of the generation have been put behind coding.roots and gone around, with none lagging.
struct CellToDecode {
  CellVertices* vertices = nullptr;
  RansDecoder decoder;  // left behind the generation's last split
  std::size_t roots_begin = 0;
  std::size_t roots_end = 0;  // of coding.roots
  Result<void> result;
};

// Decodes and applies the generation's splits of all the cells, of which each has roots behind those of the one before,
// with what undoing needs kept in the mesh. Within a generation splits of different roots do not see each other
// (CODING.md, section 9); so it is what code_generation would do cell by cell, but that numbers handed out for new
// vertices differ, and that few splits of many cells are as quick as many of one. A cell that fails as it would there
// does not keep the others from going on. Takes the roots from the first cell's on off coding.roots.
void decode_generation(FanState& state, std::uint32_t generation, std::span<CellToDecode> cells, CellCoding& coding);

}  // namespace fanstream
