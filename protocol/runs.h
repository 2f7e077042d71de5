// Lists of (cell, prefix), packed as runs of consecutive cells with the same prefix. Used by wants, release and open's
// `have`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/support/result.h"
#include "protocol/limits.h"
#include "protocol/wire.h"

namespace fanstream {

// As a prefix: every segment of the cell, however many there are.
inline constexpr std::uint32_t kAllSegments = 0xFFFFFFFFU;

// Segments 0 .. prefix-1 of one cell, or as many as it has: wanting more is no error, so that 'all cells to prefix 3'
// is one run.
struct CellPrefix {
  std::uint32_t cell = 0;
  std::uint32_t prefix = kAllSegments;
  friend bool operator==(const CellPrefix&, const CellPrefix&) = default;
};

// The same prefix of cells first_cell .. first_cell + cell_count - 1, in that order.
struct CellRun {
  std::uint32_t first_cell = 0;
  std::uint32_t cell_count = 1;
  std::uint32_t prefix = kAllSegments;
  friend bool operator==(const CellRun&, const CellRun&) = default;
};

// Joins neighbours in the list; the order is kept.
std::vector<CellRun> to_runs(std::span<const CellPrefix> list);

// Why the list cannot be sent, if it cannot: too many runs or entries, cells or prefixes beyond the limits, too many
// bytes.
Result<void> check_runs(std::span<const CellRun> runs);
// Whether the protocol can name each of them (usage), however many there are.
Result<void> check_each_run(std::span<const CellRun> runs);
// The list cut into lists that check_runs lets pass, in order. Precondition: check_each_run lets it pass.
std::vector<std::vector<CellRun>> split_runs(std::span<const CellRun> runs);

void write_runs(std::span<const CellRun> runs, WireWriter& out);
// Leaves `in` not ok() on anything malformed or beyond a limit. Cells are below kMaxCells, prefixes at most
// kMaxSegmentsPerCell or kAllSegments; whether the model has them is not known here.
std::vector<CellRun> read_runs(WireReader& in);

}  // namespace fanstream
