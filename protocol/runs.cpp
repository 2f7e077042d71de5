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

constexpr std::size_t kMostListBytes = kMaxRunsBytes - 512;  // the rest is for what stands beside it in its frame
constexpr std::size_t kMostRunBytes = 4 + 3 + 4;
constexpr std::size_t kMostCountBytes = 3;

// Zigzag distance from the end of the last run, then (prefix code * 2 + more than one cell), then cells - 2.
// Prefix code: 0 all segments, else prefix + 1.
void write_run(const CellRun& run, std::int64_t& expected, WireWriter& out) {
  const std::uint64_t prefix_code = run.prefix == kAllSegments ? 0 : std::uint64_t{run.prefix} + 1;
  out.varint(zigzag(std::int64_t{run.first_cell} - expected));
  out.varint(prefix_code * 2 + (run.cell_count > 1 ? 1 : 0));
  if (run.cell_count > 1) out.varint(run.cell_count - 2);
  expected = static_cast<std::int64_t>(run_end(run));
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

Result<void> check_each_run(std::span<const CellRun> runs) {
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (valid_run(runs[i])) continue;
    return fail(ErrorKind::usage, "run " + std::to_string(i) + " (first cell " + std::to_string(runs[i].first_cell) +
                                      ", " + std::to_string(runs[i].cell_count) + " cells, prefix " +
                                      std::to_string(runs[i].prefix) + ") is outside what the protocol can name");
  }
  return {};
}

Result<void> check_runs(std::span<const CellRun> runs) {
  if (runs.size() > kMaxRuns) {
    return fail(ErrorKind::limit, "a list of " + std::to_string(runs.size()) + " runs of cells; the limit is " +
                                      std::to_string(kMaxRuns) + ", send the most important ones first");
  }
  if (Result<void> valid = check_each_run(runs); !valid) return valid;
  std::uint64_t entries = 0;
  for (const CellRun& run : runs) entries += run.cell_count;
  if (entries > kMaxRunEntries) return fail(ErrorKind::limit, "a list of " + std::to_string(entries) + " cells");
  std::vector<std::byte> packed;
  WireWriter writer(packed);
  write_runs(runs, writer);
  if (packed.size() > kMostListBytes) {
    return fail(ErrorKind::limit, "a list of " + std::to_string(packed.size()) + " bytes; send fewer runs of cells");
  }
  return {};
}

std::vector<std::vector<CellRun>> split_runs(std::span<const CellRun> runs) {
  std::vector<std::vector<CellRun>> lists;
  std::vector<std::byte> packed;
  WireWriter writer(packed);
  std::uint64_t entries = 0;
  std::int64_t expected = 0;
  for (const CellRun& run : runs) {
    if (lists.empty() || lists.back().size() == kMaxRuns || entries + run.cell_count > kMaxRunEntries ||
        kMostCountBytes + packed.size() + kMostRunBytes > kMostListBytes) {
      lists.emplace_back();
      packed.clear();
      entries = 0;
      expected = 0;
    }
    lists.back().push_back(run);
    entries += run.cell_count;
    write_run(run, expected, writer);
  }
  return lists;
}

void write_runs(std::span<const CellRun> runs, WireWriter& out) {
  out.varint(runs.size());
  std::int64_t expected = 0;
  for (const CellRun& run : runs) write_run(run, expected, out);
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
