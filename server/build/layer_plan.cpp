#include "server/build/layer_plan.h"

#include <algorithm>
#include <cmath>

namespace fanstream {
namespace {

// Slab borders as generations, the last of them the finest. A short last slab would make cells of few splits: it joins
// the one before.
std::vector<std::uint32_t> slab_borders(std::span<const std::uint32_t> vertices, double growth) {
  std::vector<std::uint32_t> borders;
  double start = vertices[0];
  const auto finest = static_cast<std::uint32_t>(vertices.size() - 1);
  for (std::uint32_t g = 1; g <= finest; ++g) {
    if (g != finest && vertices[g] < growth * start) continue;
    const bool too_short = g == finest && !borders.empty() && vertices[g] < std::sqrt(growth) * start;
    if (too_short) {
      borders.back() = finest;
    } else {
      borders.push_back(g);
    }
    start = vertices[g];
  }
  return borders;
}

}  // namespace

Granularity default_granularity(std::uint32_t vertex_count) {
  constexpr double kSmall = 50'000.0;
  constexpr double kLarge = 400'000.0;
  const double share = std::clamp(std::log(vertex_count / kSmall) / std::log(kLarge / kSmall), 0.0, 1.0);
  const auto between = [share](double small, double large) { return small * std::pow(large / small, share); };
  return {between(48.0, 4.0), between(4.0, 11.0), between(16.0, 1.3), between(1.5, 2.5), 2.0 * share};
}

LayerPlan plan_layers(std::span<const std::uint32_t> vertices, const Granularity& options) {
  LayerPlan plan;
  std::uint32_t begin = 0;
  for (const std::uint32_t end : slab_borders(vertices, options.slab_growth)) {
    const double cells = std::fmax(1.0, std::round(static_cast<double>(vertices[begin]) / options.cell_vertices));
    const auto splits = [&](std::uint32_t from, std::uint32_t to) { return (vertices[to] - vertices[from]) / cells; };
    std::uint32_t layer_begin = begin;
    for (std::uint32_t g = begin + 1; g < end; ++g) {
      if (splits(layer_begin, g) < options.segment_splits || splits(g, end) < options.segment_splits) continue;
      plan.layer_ends.push_back(static_cast<std::uint8_t>(g));
      layer_begin = g;
    }
    plan.layer_ends.push_back(static_cast<std::uint8_t>(end));
    plan.slab_ends.push_back(static_cast<std::uint8_t>(plan.layer_ends.size()));
    begin = end;
  }
  return plan;
}

}  // namespace fanstream
