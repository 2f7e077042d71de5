#include "server/commands/output.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "common/asset/polygon_section.h"

namespace fanstream {

int report_error(const Error& error) {
  std::fflush(stdout);
  fmt::print(stderr, "fanstream-server: {}\n", error.message);
  return exit_code(error.kind);
}

int flush_output() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return 0;
  return report_error({ErrorKind::io, "standard output: " + std::error_code(errno, std::generic_category()).message()});
}

int print_json(const Json& json) {
  // Names of files may be anything but UTF-8.
  const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  std::fwrite(text.data(), 1, text.size(), stdout);
  return flush_output();
}

BuildReport report_of(const AssetFile& asset) {
  const AssetHead& head = *asset.asset_head();
  const AssetIndex& index = *asset.asset_index();
  BuildReport report;
  report.vertices = head.vertex_count;
  report.triangles = head.triangle_count;
  report.components = head.component_count;
  report.position_bits = head.grid.bits();
  report.generations = head.generation_count();
  report.base_vertices = static_cast<std::uint32_t>(head.base.places.size());
  report.base_triangles = static_cast<std::uint32_t>(head.base.triangles.size());
  report.splits = report.vertices - report.base_vertices;
  report.cells = static_cast<std::uint32_t>(index.cells.size());
  report.segments =
      static_cast<std::uint32_t>(std::count_if(index.segments.begin(), index.segments.end(),
                                               [](const SegmentEntry& segment) { return segment.size_bytes != 0; }));
  report.total_bytes = asset.size_bytes();
  report.base_bytes = head.base_bytes;
  report.polygon_bytes = head.polygon_bytes;
  for (const SegmentEntry& segment : index.segments) report.split_bytes += segment.size_bytes;
  report.table_bytes = report.total_bytes - report.base_bytes - report.split_bytes - report.polygon_bytes;
  if (head.polygon_bytes == 0) return report;
  const auto polygons = read_polygons(asset.segment(index.polygon_cell(), 0), head, index, asset.name());
  if (!polygons) return report;  // verify says why
  report.quads = polygons->quads;
  report.larger_polygons = polygons->larger;
  return report;
}

Json json_of(const BuildReport& report) {
  return {{"vertices", report.vertices},
          {"triangles", report.triangles},
          {"components", report.components},
          {"position_bits", report.position_bits},
          {"generations", report.generations},
          {"base_vertices", report.base_vertices},
          {"base_triangles", report.base_triangles},
          {"splits", report.splits},
          {"cells", report.cells},
          {"segments", report.segments},
          {"quads", report.quads},
          {"larger_polygons", report.larger_polygons},
          {"bytes",
           {{"total", report.total_bytes},
            {"base", report.base_bytes},
            {"splits", report.split_bytes},
            {"tables", report.table_bytes},
            {"polygons", report.polygon_bytes}}},
          {"bits_per_vertex", report.bits_per_vertex()}};
}

std::string grouped(std::uint64_t number) {
  const std::string digits = std::to_string(number);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
    text += digits[i];
  }
  return text;
}

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024U;
}

std::string summary_of(const BuildReport& report, const Digest& digest) {
  std::string text = fmt::format("  model    {} vertices, {} triangles, {} component{}, {}-bit grid\n",
                                 grouped(report.vertices), grouped(report.triangles), grouped(report.components),
                                 report.components == 1 ? "" : "s", report.position_bits);
  text += fmt::format("  base     {} vertices, {} triangles\n", grouped(report.base_vertices),
                      grouped(report.base_triangles));
  text += fmt::format("  splits   {} in {} generations, {} cells, {} segments\n", grouped(report.splits),
                      report.generations, grouped(report.cells), grouped(report.segments));
  text += fmt::format("  size     {} bytes, {:.2f} bits per vertex\n", grouped(report.total_bytes),
                      report.bits_per_vertex());
  text += fmt::format("           base {}, splits {}, tables {}\n", grouped(report.base_bytes),
                      grouped(report.split_bytes), grouped(report.table_bytes));
  if (report.polygon_bytes > 0) {
    text += fmt::format("  polygons {} quads, {} with more corners, {} bytes\n", grouped(report.quads),
                        grouped(report.larger_polygons), grouped(report.polygon_bytes));
  }
  text += fmt::format("  digest   {}\n", text_of(digest));
  return text;
}

}  // namespace fanstream
