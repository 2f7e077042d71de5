#include "client/commands/output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <system_error>

namespace fanstream {

int report_error(const Error& error) {
  std::fflush(stdout);
  fmt::print(stderr, "fanstream-client: {}\n", error.message);
  return exit_code(error.kind);
}

int flush_output() {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return 0;
  const std::string reason = std::error_code(errno, std::generic_category()).message();
  return report_error({ErrorKind::io, "standard output: " + reason});
}

int print_json(const Json& json) {
  // A file name need not be UTF-8.
  fmt::print("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
  return flush_output();
}

std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t end = text.size(); end > 3; end -= 3) text.insert(end - 3, 1, ',');
  return text;
}

std::string size_text(std::uint64_t bytes) {
  if (bytes < 1000) return fmt::format("{} B", bytes);
  if (bytes < 1'000'000) return fmt::format("{:.1f} kB", static_cast<double>(bytes) / 1e3);
  return fmt::format("{:.2f} MB", static_cast<double>(bytes) / 1e6);
}

Json json_of(const glm::dvec3& p) { return Json::array({p.x, p.y, p.z}); }

Json json_of(const FetchReport& report) {
  return {{"source", report.source},
          {"model", report.model},
          {"digest", report.digest},
          {"bytes",
           {{"received", report.bytes.received},
            {"head", report.bytes.head},
            {"index", report.bytes.index},
            {"segments", report.bytes.segments}}},
          {"segments", report.segments},
          {"segments_total", report.segments_total},
          {"vertices", report.vertices},
          {"triangles", report.triangles},
          {"full_vertices", report.full_vertices},
          {"full_triangles", report.full_triangles},
          {"complete", report.complete},
          {"seconds",
           {{"connect", report.seconds.connect},
            {"head", report.seconds.head},
            {"first_mesh", report.seconds.first_mesh},
            {"complete", report.seconds.complete}}}};
}

std::string summary_of(const FetchReport& report) {
  std::string text = fmt::format("model       {}, digest {}\n", report.model, report.digest);
  text += fmt::format("mesh        {} vertices, {} triangles", grouped(report.vertices), grouped(report.triangles));
  text += report.complete ? ", complete and verified\n"
                          : fmt::format("\n            of {} vertices, {} triangles\n", grouped(report.full_vertices),
                                        grouped(report.full_triangles));
  text += fmt::format("received    {} bytes: head {}, index {}, segments {}\n", grouped(report.bytes.received),
                      grouped(report.bytes.head), grouped(report.bytes.index), grouped(report.bytes.segments));
  text += fmt::format("seconds     connected {:.3f}, first mesh {:.3f}, done {:.3f}\n", report.seconds.connect,
                      report.seconds.first_mesh, report.seconds.complete);
  return text;
}

Result<void> check_output_path(const std::filesystem::path& path, const std::string& extension) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  std::string given = path.extension().string();
  std::transform(given.begin(), given.end(), given.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (!extension.empty() && given != extension) {
    return fail(ErrorKind::usage,
                path.string() + ": the name does not end in " + extension + ", the only format there is");
  }
  if (fs::is_directory(path, ignored)) return fail(ErrorKind::usage, path.string() + ": is a folder; name a file");
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored)) {
    return fail(ErrorKind::not_found, path.string() + ": there is no folder " + folder.string() + "; make it first");
  }
  return {};
}

Result<void> check_output_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (std::filesystem::is_directory(folder, ignored)) return {};
  if (std::filesystem::exists(folder, ignored)) {
    return fail(ErrorKind::usage, folder.string() + ": is a file; name a folder");
  }
  // "new/" has the parent "new".
  return check_output_path(folder.has_filename() ? folder : folder.parent_path(), "");
}

Result<void> make_output_folder(const std::filesystem::path& folder) {
  std::error_code error;
  if (Result<void> checked = check_output_folder(folder); !checked) return checked;
  std::filesystem::create_directory(folder, error);
  if (error) return fail(ErrorKind::io, folder.string() + ": cannot be made: " + error.message());
  return {};
}

}  // namespace fanstream
