// The tables of fanstream-bench views, and how the figures stand against the limits.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/measure_views.h"
#include "tests/bench/report.h"

namespace fanstream::bench {

// Only those of which something was measured; the limits last.
std::vector<Section> views_sections(const std::vector<ViewsFigures>& models);

// `context`: machine and command, one line each.
std::string print_views(const std::vector<ViewsFigures>& models, const std::vector<std::string>& context,
                        ReportFormat format);

// Models with more vertices are large: a view of them takes a smaller share, and limits on forced shares hold.
inline constexpr std::uint32_t kLargeModelVertices = 400'000;

}  // namespace fanstream::bench
