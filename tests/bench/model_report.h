// The tables of fanstream-bench models, and how the figures stand against the limits.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/measure_model.h"
#include "tests/bench/table.h"

namespace fanstream::bench {

struct Section {
  std::string key;    // in JSON
  std::string title;  // for people, with what the figures mean
  Table table;
};

// sizes, forced share, speed, shape by model and level, and limits.
std::vector<Section> report_sections(const std::vector<ModelFigures>& models);

enum class ReportFormat { text, markdown, json };
// `context`: machine and command, one line each.
std::string print_report(const std::vector<ModelFigures>& models, const std::vector<std::string>& context,
                         ReportFormat format);

// Of the positive finite ones; 0 if there are none.
double geometric_mean(const std::vector<double>& values);

}  // namespace fanstream::bench
