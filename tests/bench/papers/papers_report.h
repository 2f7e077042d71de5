// All parts of `fanstream-bench papers`, and how they are run.
#pragma once

#include <optional>
#include <span>

#include "common/mesh/triangle_mesh.h"
#include "tests/bench/papers/papers_options.h"

namespace fanstream::bench {

struct PapersPart {
  std::string_view name;      // on the command line
  std::string_view document;  // what its source is
  Result<std::vector<Section>> (*measure)(const PapersOptions& options);
};
// In the order of the documents.
std::span<const PapersPart> papers_parts();

struct PapersFigures {
  std::vector<Section> sections;  // each title begins with its part's name
  std::vector<Error> failures;    // each begins with its part's name
};

// Measures part after part. Goes on after a failure: the others are worth having all the same. `options.progress` is
// told of each part's stages, after "[1/5] fans: ". Fails (not_found) where the folder of models is missing, (io) where
// that of pictures cannot be made.
Result<PapersFigures> measure_papers(std::span<const PapersPart> parts, const PapersOptions& options);

// One of the meshes of `options.models`, cleaned. A missing one is named, with what to do.
Result<TriangleMesh> papers_mesh(const PapersOptions& options, const std::string& file);

}  // namespace fanstream::bench
