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

// Models of which distances are limited: it takes about as long as all the rest of a build. Of fewer vertices what
// counts is that valences are even (merge_valences.h).
constexpr std::uint32_t kFewestLimited = 1'000;
constexpr std::uint32_t kMostLimited = 100'000;
constexpr std::uint32_t kFewestMedium = 20'000;

}  // namespace

Granularity default_granularity(std::uint32_t vertex_count) {
  const auto share_between = [vertex_count](double few, double many) {
    return std::clamp(std::log(vertex_count / few) / std::log(many / few), 0.0, 1.0);
  };
  const double even = share_between(20'000.0, 40'000.0);
  const double large = share_between(50'000.0, 400'000.0);
  const auto between = [](double share, double from, double to) { return from * std::pow(to / from, share); };
  const double medium = share_between(5'000.0, kFewestMedium);
  const bool limited = vertex_count >= kFewestLimited && vertex_count <= kMostLimited;
  const bool is_medium = limited && vertex_count >= kFewestMedium;
  Granularity granularity;
  granularity.cell_vertices = between(large, is_medium ? 64.0 : 48.0, 3.7);
  granularity.slab_growth = between(large, 4.0, 9.5);
  granularity.segment_splits = between(large, between(even, 20.0, 8.0), 1.3);
  granularity.edges_per_vertex = between(large, is_medium ? 1.65 : 1.5, 2.5);
  granularity.evenness = std::min(2.0 * even, is_medium ? 1.0 : 2.0) + 2.0 * large;
  granularity.distance_growth = limited ? between(even, between(medium, 1.8, 1.45), 1.27) : 0.0;
  granularity.fine_share = 1.0 - 0.05 * large;
  return granularity;
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
