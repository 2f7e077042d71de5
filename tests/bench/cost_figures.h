// Costs and placements side by side: what an asset takes with each, and how close its levels are.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "server/build/asset_builder.h"
#include "tests/bench/rate_distortion.h"
#include "tests/bench/report.h"

namespace fanstream::bench {

struct CostTableOptions {
  int position_bits = 12;
  std::vector<CostOptions> costs;  // the first is what others are compared with
  std::vector<double> level_shares{0.5, 0.25, 0.1, 0.05};
  std::vector<double> rms{1e-3, 5e-4};  // of the diagonal, to which bytes are counted
  std::size_t face_samples = 100'000;
  std::function<void(std::string_view stage)> progress;  // may be empty
};

// "curvature gaussian, optimal"
std::string text_of(const CostOptions& cost);
// Every cost with every placement, as its defaults have it; with the other kinds of quadrics and curvature.
std::vector<CostOptions> all_costs();

struct CostLevel {
  double share = 0.0;
  double rms = 0.0, max = 0.0;  // both directions, of the diagonal; NaN where FM0 has more vertices
};
struct CostFigures {
  std::string model;
  CostOptions cost;
  BuildReport build;
  double build_cpu_seconds = 0.0;
  std::vector<CostLevel> levels;
  std::vector<std::optional<double>> bytes_at_rms;  // layer by layer, interpolated between their ends
};

// Imports and cleans once, then builds by each cost and measures. Fails where a rebuilt model is not the quantised input.
Result<std::vector<CostFigures>> measure_costs(const std::filesystem::path& path, const CostTableOptions& options);

// One table a model, and the geometric means over the models against the first cost's.
std::vector<Section> cost_sections(const std::vector<CostFigures>& figures, const CostTableOptions& options);

}  // namespace fanstream::bench
