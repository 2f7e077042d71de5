#include "protocol/runs.h"

#include <algorithm>
#include <string>

namespace fanstream {
namespace {

std::uint64_t run_end(const CellRun& run) { return std::uint64_t{run.first_cell} + run.cell_count; }

bool valid_run(const CellRun& run) {
  return run.cell_count > 0 && run_end(run) <= kMaxCells &&
         (run.prefix <= kMaxSegmentsPerCell || run.prefix == kAllSegments);
}

}  // namespace

std::vector<CellRun> to_runs(std::span<const CellPrefix> list) {
  std::vector<CellRun> runs;
  for (const CellPrefix& entry : list) {
    if (!runs.empty() && runs.back().prefix == entry.prefix && run_end(runs.back()) == entry.cell) {
      ++runs.back().cell_count;
    } else {
      runs.push_back({entry.cell, 1, entry.prefix});
    }
  }
  return runs;
}

Result<void> check_runs(std::span<const CellRun> runs) {
  if (runs.size() > kMaxRuns) {
    return fail(ErrorKind::limit, "a list of " + std::to_string(runs.size()) + " runs of cells; the limit is " +
                                      std::to_string(kMaxRuns) + ", send the most important ones first");
  }
  std::uint64_t entries = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    entries += runs[i].cell_count;
    if (!valid_run(runs[i])) {
      return fail(ErrorKind::usage, "run " + std::to_string(i) + " (first cell " + std::to_string(runs[i].first_cell) +
                                        ", " + std::to_string(runs[i].cell_count) + " cells, prefix " +
                                        std::to_string(runs[i].prefix) + ") is outside what the protocol can name");
    }
  }
  if (entries > kMaxRunEntries) return fail(ErrorKind::limit, "a list of " + std::to_string(entries) + " cells");
  std::vector<std::byte> packed;
  WireWriter writer(packed);
  write_runs(runs, writer);
  if (packed.size() > kMaxRunsBytes - 512) {
    return fail(ErrorKind::limit, "a list of " + std::to_string(packed.size()) + " bytes; send fewer runs of cells");
  }
  return {};
}

// Per run: zigzag distance from the end of the last run, then (prefix code * 2 + more than one cell), then cells - 2.
// Prefix code: 0 all segments, else prefix + 1.
void write_runs(std::span<const CellRun> runs, WireWriter& out) {
  out.varint(runs.size());
  std::int64_t expected = 0;
  for (const CellRun& run : runs) {
    const std::uint64_t prefix_code = run.prefix == kAllSegments ? 0 : std::uint64_t{run.prefix} + 1;
    out.varint(zigzag(std::int64_t{run.first_cell} - expected));
    out.varint(prefix_code * 2 + (run.cell_count > 1 ? 1 : 0));
    if (run.cell_count > 1) out.varint(run.cell_count - 2);
    expected = static_cast<std::int64_t>(run_end(run));
  }
}

std::vector<CellRun> read_runs(WireReader& in) {
  const auto count = static_cast<std::size_t>(in.varint(kMaxRuns));
  if (!in.ok() || count > in.remaining() / 2) {
    in.reject();
    return {};
  }
  std::vector<CellRun> runs;
  runs.reserve(count);
  std::int64_t expected = 0;
  std::uint64_t entries = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t first = expected + unzigzag(in.varint(2ULL * kMaxCells));
    const std::uint64_t code = in.varint(2ULL * (kMaxSegmentsPerCell + 1) + 1);
    const std::uint64_t cells = (code & 1U) != 0 ? in.varint(kMaxCells) + 2 : 1;
    entries += cells;
    if (!in.ok() || first < 0 || first > std::int64_t{kMaxCells} || entries > kMaxRunEntries) {
      in.reject();
      return {};
    }
    const std::uint64_t prefix_code = code >> 1;
    const CellRun run{static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(cells),
                      prefix_code == 0 ? kAllSegments : static_cast<std::uint32_t>(prefix_code - 1)};
    if (!valid_run(run)) {
      in.reject();
      return {};
    }
    expected = static_cast<std::int64_t>(run_end(run));
    runs.push_back(run);
  }
  return runs;
}

}  // namespace fanstream
