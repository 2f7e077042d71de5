#include "tests/bench/papers/papers_report.h"

#include <fmt/format.h>

#include <array>
#include <chrono>

#include "tests/bench/cleaned_mesh.h"
#include "tests/bench/papers/curvature_tables.h"
#include "tests/bench/papers/fans_tables.h"
#include "tests/bench/papers/local_restoration_tables.h"
#include "tests/bench/papers/reduction_tables.h"
#include "tests/bench/papers/subdivision_tables.h"

namespace fanstream::bench {
namespace {

constexpr std::array kParts{
    PapersPart{"fans", "Suzuki, Okamoto, Kanai: LOD based on Progressive Fan Representation", measure_fans},
    PapersPart{"restoration", "Odauchi, Tsukiji: real-time local simplification", measure_local_restoration},
    PapersPart{"curvature", "Kim, Kim, Kim: extended QEM", measure_curvature},
    PapersPart{"reduction", "Polygon reduction on the device", measure_reduction},
    PapersPart{"subdivision", "Miura, Adachi, Ikedo: sqrt(2)-subdivision", measure_subdivision},
};

Result<void> check_folders(const PapersOptions& options) {
  std::error_code error;
  if (!std::filesystem::is_directory(options.models, error)) {
    return fail(ErrorKind::not_found, fmt::format("{}: no such folder; give the one that holds the meshes as --models",
                                                  options.models.string()));
  }
  std::filesystem::create_directories(options.pictures, error);
  if (!std::filesystem::is_directory(options.pictures, error)) {
    return fail(ErrorKind::io, fmt::format("{}: pictures go there, but it is no folder and cannot be made one",
                                           options.pictures.string()));
  }
  return {};
}

}  // namespace

std::span<const PapersPart> papers_parts() { return kParts; }

Result<PapersFigures> measure_papers(std::span<const PapersPart> parts, const PapersOptions& options) {
  if (Result<void> checked = check_folders(options); !checked) return tl::unexpected(checked.error());
  PapersFigures figures;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const PapersPart& part = parts[i];
    const std::string name(part.name);
    PapersOptions told = options;
    told.progress = [&](std::string_view stage) {
      if (options.progress) options.progress(fmt::format("[{}/{}] {}: {}", i + 1, parts.size(), name, stage));
    };
    const auto start = std::chrono::steady_clock::now();
    told.progress(part.document);
    Result<std::vector<Section>> measured = part.measure(told);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    told.progress(fmt::format("{} after {:.1f} s", measured ? "done" : "failed", taken.count()));
    if (!measured) {
      figures.failures.push_back(with_context(measured.error(), name));
      continue;
    }
    for (Section& section : *measured) {
      section.title = name + ": " + section.title;
      if (!section.key.starts_with(name)) section.key = name + "_" + section.key;
      figures.sections.push_back(std::move(section));
    }
  }
  return figures;
}

Result<TriangleMesh> papers_mesh(const PapersOptions& options, const std::string& file) {
  const std::filesystem::path path = options.models / file;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    return fail(
        ErrorKind::not_found,
        fmt::format("{}: no such mesh; put it there, or give the folder that holds it as --models", path.string()));
  }
  return cleaned_mesh(path);
}

}  // namespace fanstream::bench
