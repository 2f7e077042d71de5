// Where a split's hidden centre is expected, and how far off that may be: from the ring of the root alone.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "common/coding/residual_tables.h"
#include "common/coding/ring_geometry.h"
#include "common/coding/split_model.h"

namespace fanstream {

// The size of one code step of each axis, in grid steps.
struct AxisUnits {
  Float4 size{};        // the fourth lane is 0
  Float4 reciprocal{};  // likewise
  explicit AxisUnits(const glm::vec3& unit)
      : size(float4(unit)), reciprocal{1.0F / unit.x, 1.0F / unit.y, 1.0F / unit.z, 0.0F} {}
};

// What prediction is computed from, once the arc and the parent's position are known: means of the spokes inside the
// hidden centre's arc, of the wings, inside the other arc, and at the ends of its own. The hidden centre is the one
// that is not where the parent was.
struct RingFeatures {
  bool middle = false;    // the displacement itself is predicted, not the hidden centre's place
  std::uint32_t arc = 1;  // ring steps on the hidden centre's side
  std::array<Float4, PredictionContexts::kFeatures> features{};
};
// For who learns the weights; a coder predicts from the spokes themselves (RingKernels::predict).
RingFeatures ring_features(const RingGeometry& ring, const FanSplit& split);

// The predicted vector, and where and how far its error may lead, in grid steps.
struct Prediction {
  Float4 mean;
  Float4 direction;  // its part in the tangent plane is the direction along which the error differs
  Float4 normal;
  Float4 variances;  // along, across, and off the plane
};

// Of a class of PredictionContexts, given the features' weighted sum.
inline Prediction prediction_of(const PhaseModel& model, const RingGeometry& ring, std::size_t context, Float4 mean) {
  const auto size = static_cast<std::size_t>(SpreadContexts::size_class(ring.mean_square()));
  const auto off_plane = static_cast<std::size_t>(SpreadContexts::normal(ring.bend_square(), ring.mean_square()));
  const Float4 variances = {model.variances[SpreadContexts::kAlong + size],
                            model.variances[SpreadContexts::kAcross + size], model.variances[off_plane], 0.0F};
  return {mean, mean, ring.normal(), float4(model.scales[context]) * variances};
}

// Of the shift of a free parent, once the displacement (in grid steps) is known.
inline Prediction shift_prediction_of(const PhaseModel& model, const RingGeometry& ring, Float4 displacement,
                                      Float4 mean) {
  const float length2 = dot3(displacement, displacement);
  constexpr float kRounding = 0.125F;  // places are whole steps
  const Float4 variances = {model.shift_variances[0] * length2 + kRounding,
                            model.shift_variances[1] * length2 + kRounding,
                            model.shift_variances[2] * ring.bend_square() + kRounding, 0.0F};
  return {mean, displacement, ring.normal(), variances};
}

// The covariances of the errors of several predictions, in code steps, as chains: what each axis, in coding order,
// expects given those before.
struct AxisChains {
  static constexpr std::size_t kMost = 16;  // predictions
  using Row = std::array<float, kMost>;
  alignas(32) std::array<Row, 3> mean;      // by place in the order
  alignas(32) std::array<Row, 3> expected;  // likewise, given the axes before
  alignas(32) std::array<Row, 3> variance;  // likewise
  alignas(32) Row second_from_first;        // regression on the errors before
  alignas(32) Row third_from_first;
  alignas(32) Row third_from_second;
  // Which axis is last, that closest to the normal; before it come the two after it.
  alignas(32) std::array<std::uint32_t, kMost> last;
  static constexpr std::array<std::array<std::uint8_t, 3>, 3> kOrders = {{{1, 2, 0}, {2, 0, 1}, {0, 1, 2}}};
  const std::array<std::uint8_t, 3>& order(std::size_t i) const { return kOrders[last[i]]; }
};

// How the residuals of several values are coded.
struct ResidualChoices {
  alignas(32) std::array<std::uint32_t, AxisChains::kMost> zero;
  alignas(32) std::array<std::uint32_t, AxisChains::kMost> mirror;
  alignas(32) std::array<std::uint32_t, AxisChains::kMost> table;
  alignas(32) std::array<std::uint32_t, AxisChains::kMost> raw_bits;
  ResidualChoice operator[](std::size_t i) const {
    return {static_cast<std::int32_t>(zero[i]), static_cast<std::int32_t>(mirror[i]), table[i],
            static_cast<std::int32_t>(raw_bits[i])};
  }
};

}  // namespace fanstream
