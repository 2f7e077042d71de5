// Which measure orders the merges, and where it may put their parents. COSTS.md compares them.
//
// Costs
//   fans       Suzuki, Okamoto, Kanai, section 3.3 (after Hoppe et al. 1993): the growth of E = E_dist + E_spring.
//   E_dist sums
//              the squared distances of a point set X from the surface, E_spring kappa * |vj - vk|^2 over its edges. X
//              are the original vertices and `samples` more points. Each is kept assigned to the face nearest to it.
//   quadric    Garland and Heckbert 1997: squared distances from the planes of the faces a vertex stands for, by area.
//   curvature  Kim, Kim, Kim: the quadric, with discrete curvature in the planes' constant terms (vertex_curvature.h).
//
// Placements of the parent of s and t
//   ends+middle  the best of s, (s + t)/2 and t (Suzuki et al.). A middle must be worth its bits.
//   end          the better of s and t: every level's vertices are vertices of the model.
//   segment      P = s + k u, u = t - s, k = -(u A s^T + s A u^T) / (2 u A u^T) clamped to [0, 1], A the quadric's
//   matrix and
//                points homogeneous; where u A u^T = 0, that is where the cost is the same all along, the better end.
//   optimal      where the cost is least of all; where that is not one point, or far away, as `segment`.
//
// Valences, of merges of like cost
//   any          do not matter.
//   regular      those go first that leave valences near 6 and, where few vertices are left, even: merge_valences.h.
//
// Every cost supports every placement. `segment` and `optimal` make free parents (ParentPosition::free), with which an
// asset takes about half as many bytes again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/support/result.h"

namespace fanstream {

enum class CostKind : std::uint8_t { fans, quadric, curvature };
enum class Placement : std::uint8_t { ends_middle, end, segment, optimal };
enum class Curvature : std::uint8_t { mean, gaussian, principal };
// accumulated: a vertex stands for the original faces around all that was merged into it. memoryless: at the start of
// every generation for the faces that are around it then (after Lindstrom and Turk 1998): what has been given up is
// given up.
enum class Quadrics : std::uint8_t { accumulated, memoryless };
enum class Valences : std::uint8_t { any, regular };

struct CostOptions {
  CostKind cost = CostKind::quadric;
  Placement placement = Placement::ends_middle;
  std::optional<Quadrics> quadrics{};    // of quadric and curvature; default: kUsualQuadrics
  std::optional<Curvature> curvature{};  // of curvature; default: mean
  std::optional<double> kappa{};         // of fans: the springs' stiffness, at least 0; default: kUsualKappa
  std::optional<std::uint32_t>
      samples{};           // of fans: points besides the vertices, by area; default: 0, at most kMostSamples
  std::uint64_t seed = 1;  // of the samples
  std::optional<Valences> valences{};  // default: regular for quadric; any for the others, whose sources have none

  static constexpr Quadrics kUsualQuadrics = Quadrics::memoryless;
  static constexpr double kUsualKappa = 1e-3;
  static constexpr std::uint32_t kMostSamples = 1U << 28U;
  bool operator==(const CostOptions&) const = default;
};

// Fail (usage) for a name that is not known, and list those that are: "no cost is called 'qem'; there are fans, ...".
Result<CostKind> cost_of_name(std::string_view name);
Result<Placement> placement_of_name(std::string_view name);
Result<Curvature> curvature_of_name(std::string_view name);
Result<Quadrics> quadrics_of_name(std::string_view name);
Result<Valences> valences_of_name(std::string_view name);
std::string_view name_of(CostKind cost);
std::string_view name_of(Placement placement);
std::string_view name_of(Curvature curvature);
std::string_view name_of(Quadrics quadrics);
std::string_view name_of(Valences valences);

// Those chosen, or the default.
Valences valences_of(const CostOptions& options);

// Fails (usage) where an option belongs to another cost, or is out of range; says which, and what to do.
Result<void> check_cost_options(const CostOptions& options);

}  // namespace fanstream
