#include "server/build/cost_options.h"

#include <array>
#include <cmath>

namespace fanstream {
namespace {

// In the order of the enumerators.
constexpr std::array<std::string_view, 3> kCosts{"fans", "quadric", "curvature"};
constexpr std::array<std::string_view, 4> kPlacements{"ends+middle", "end", "segment", "optimal"};
constexpr std::array<std::string_view, 3> kCurvatures{"mean", "gaussian", "principal"};
constexpr std::array<std::string_view, 2> kQuadrics{"accumulated", "memoryless"};
constexpr std::array<std::string_view, 2> kValences{"any", "regular"};

template <class Kind, std::size_t count>
Result<Kind> find(std::string_view what, std::string_view name, const std::array<std::string_view, count>& names) {
  std::string known;
  for (std::size_t i = 0; i < count; ++i) {
    if (names[i] == name) return static_cast<Kind>(i);
    known += std::string(i == 0 ? "" : i + 1 == count ? " and " : ", ") + std::string(names[i]);
  }
  return fail(ErrorKind::usage,
              "no " + std::string(what) + " is called '" + std::string(name) + "'; there are " + known);
}

std::string of_cost(CostKind cost) { return "cost " + std::string(name_of(cost)); }

}  // namespace

Result<CostKind> cost_of_name(std::string_view name) { return find<CostKind>("cost", name, kCosts); }
Result<Placement> placement_of_name(std::string_view name) { return find<Placement>("placement", name, kPlacements); }
Result<Curvature> curvature_of_name(std::string_view name) { return find<Curvature>("curvature", name, kCurvatures); }
Result<Quadrics> quadrics_of_name(std::string_view name) { return find<Quadrics>("kind of quadrics", name, kQuadrics); }
Result<Valences> valences_of_name(std::string_view name) {
  return find<Valences>("order by valences", name, kValences);
}
std::string_view name_of(CostKind cost) { return kCosts[static_cast<std::size_t>(cost)]; }
std::string_view name_of(Placement placement) { return kPlacements[static_cast<std::size_t>(placement)]; }
std::string_view name_of(Curvature curvature) { return kCurvatures[static_cast<std::size_t>(curvature)]; }
std::string_view name_of(Quadrics quadrics) { return kQuadrics[static_cast<std::size_t>(quadrics)]; }
std::string_view name_of(Valences valences) { return kValences[static_cast<std::size_t>(valences)]; }

Valences valences_of(const CostOptions& options) {
  return options.valences.value_or(options.cost == CostKind::quadric ? Valences::regular : Valences::any);
}

Result<void> check_cost_options(const CostOptions& options) {
  const bool fans = options.cost == CostKind::fans;
  if (options.quadrics && fans) {
    return fail(ErrorKind::usage, of_cost(options.cost) + " measures distances from points and has no quadrics to be " +
                                      std::string(name_of(*options.quadrics)) + "; choose quadric or curvature");
  }
  if (options.curvature && options.cost != CostKind::curvature) {
    return fail(ErrorKind::usage, of_cost(options.cost) + " does not look at curvature; choose cost curvature");
  }
  if ((options.kappa || options.samples) && !fans) {
    return fail(ErrorKind::usage, of_cost(options.cost) + " has no " + (options.kappa ? "springs" : "point set") +
                                      "; kappa and samples belong to cost fans");
  }
  if (options.kappa && !(*options.kappa >= 0.0 && std::isfinite(*options.kappa))) {
    return fail(ErrorKind::usage, "kappa must be a number of at least 0");
  }
  if (options.samples && *options.samples > CostOptions::kMostSamples) {
    return fail(ErrorKind::usage, std::to_string(*options.samples) + " samples, the limit is " +
                                      std::to_string(CostOptions::kMostSamples));
  }
  return {};
}

}  // namespace fanstream
