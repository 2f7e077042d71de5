// What every part of `fanstream-bench papers` is given: one part a source document, each a list of sections.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

#include "common/support/result.h"
#include "tests/bench/report.h"

namespace fanstream::bench {

struct PapersOptions {
  std::filesystem::path models;    // the folder that holds the meshes named in ../shared/data/README.md
  std::filesystem::path pictures;  // pictures and plots go here; exists
  bool quick = false;              // fewer repetitions: for a look, not for a record
  std::function<void(std::string_view stage)> progress;  // may be empty
};

// A part is a function of its own header in this folder:
//   Result<std::vector<Section>> measure_...(const PapersOptions& options);
// Its tables have the document's figures beside ours. Errors name the mesh that is missing or bad.

}  // namespace fanstream::bench
