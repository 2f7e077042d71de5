// The tables of fanstream-bench models, and how the figures stand against the limits.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/measure_model.h"
#include "tests/bench/report.h"

namespace fanstream::bench {

// sizes, forced share, speed, shape by model and level, and limits.
std::vector<Section> report_sections(const std::vector<ModelFigures>& models);

// `context`: machine and command, one line each.
std::string print_report(const std::vector<ModelFigures>& models, const std::vector<std::string>& context,
                         ReportFormat format);

// Of the positive finite ones; 0 if there are none.
double geometric_mean(const std::vector<double>& values);

}  // namespace fanstream::bench
