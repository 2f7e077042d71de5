// Where a split's hidden centre is expected, and how far off that may be: from the ring of the root alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

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

// What prediction and spreads are computed from, once the arc and the parent's position are known.
struct RingFeatures {
  bool middle = false;    // the displacement itself is predicted, not the hidden centre's place
  std::uint32_t arc = 1;  // ring steps on the hidden centre's side
  std::array<Float4, PredictionContexts::kFeatures> features{};
};

// Means of the spokes inside the hidden centre's arc, of the wings, inside the other arc, and at the ends of its own.
// The hidden centre is the one that is not where the parent was.
inline RingFeatures ring_features(const RingGeometry& ring, const FanSplit& split) {
  const std::uint32_t size = ring.size();
  const bool hidden_root = split.parent == ParentPosition::added;
  const std::uint32_t swapped = (split.first ^ split.last) & (0U - static_cast<std::uint32_t>(hidden_root));
  const std::uint32_t first = split.first ^ swapped;
  const std::uint32_t last = split.last ^ swapped;
  RingFeatures result;
  result.middle = split.parent == ParentPosition::middle || split.parent == ParentPosition::free;
  result.arc = ring.steps(first, last);
  const Float4 inside = ring.spoke_sum(first + result.arc) - ring.spoke_sum(first + 1);
  const Float4 both_wings = ring.spoke(first) + ring.spoke(last);
  const Float4 outside = (ring.spoke_sum(size) - inside) - both_wings;
  auto inside_count = static_cast<float>(result.arc - 1);
  auto outside_count = static_cast<float>(size - result.arc - 1);
  float wing_share = 0.5F;
  if (ring.is_open()) [[unlikely]] {
    if (ring.gap() == first || ring.gap() == last) {
      wing_share = 1.0F;
    } else if (ring.steps(first, ring.gap()) < result.arc) {
      inside_count -= 1.0F;
    } else {
      outside_count -= 1.0F;
    }
  }
  const Float4 ends = ring.spoke(first + 1) + ring.spoke(first + result.arc - 1);
  result.features = {inside * float4(1.0F / std::max(inside_count, 1.0F)), both_wings * float4(wing_share),
                     outside * float4(1.0F / std::max(outside_count, 1.0F)),
                     ends * float4(result.arc >= 2 ? 0.5F : 0.0F)};
  return result;
}

// The predicted vector and the frame of its error, in grid steps.
struct Prediction {
  Float4 mean{};
  Float4 along{};  // of any length, in the tangent plane: the direction in which the error differs
  float variance_along = 1.0F;
  float variance_across = 1.0F;
  float variance_normal = 1.0F;
};

inline Prediction predict(const SplitModel& model, const RingGeometry& ring, const RingFeatures& features) {
  const auto context =
      static_cast<std::size_t>(PredictionContexts::index(features.middle, ring.is_open(), features.arc));
  const auto& weights = model.weights[context];
  Prediction result;
  result.mean = (float4(weights[0]) * features.features[0] + float4(weights[1]) * features.features[1]) +
                (float4(weights[2]) * features.features[2] + float4(weights[3]) * features.features[3]);
  const Float4 n = ring.normal();
  result.along = result.mean - float4(dot3(result.mean, n)) * n;
  const auto size = static_cast<std::size_t>(SpreadContexts::size_class(ring.mean_square()));
  const float scale = features.middle ? model.variances[SpreadContexts::kMiddleShift] : 1.0F;
  result.variance_along = scale * model.variances[SpreadContexts::kAlong + size];
  result.variance_across = scale * model.variances[SpreadContexts::kAcross + size];
  result.variance_normal =
      scale * model.variances[static_cast<std::size_t>(SpreadContexts::normal(ring.bend_square(), ring.mean_square()))];
  return result;
}

// Of the shift of a free parent, once the displacement (in grid steps) is known.
inline Prediction predict_shift(const SplitModel& model, const RingGeometry& ring, const RingFeatures& features,
                                Float4 displacement) {
  const auto& weights = model.shift_weights;
  Prediction result;
  result.mean = (float4(weights[0]) * features.features[0] + float4(weights[1]) * features.features[1]) +
                (float4(weights[2]) * features.features[2] + float4(weights[3]) * features.features[3]);
  const Float4 n = ring.normal();
  result.along = displacement - float4(dot3(displacement, n)) * n;
  const float length2 = dot3(displacement, displacement);
  constexpr float kRounding = 0.125F;  // places are whole steps
  result.variance_along = model.shift_variances[0] * length2 + kRounding;
  result.variance_across = model.shift_variances[1] * length2 + kRounding;
  result.variance_normal = model.shift_variances[2] * ring.bend_square() + kRounding;
  return result;
}

// The covariance of the error in code steps as a chain: what each axis, in coding order, expects given those before.
struct AxisChain {
  std::array<int, 3> order{};       // the axis closest to the normal comes last
  std::array<float, 3> mean{};      // code steps, by place in the order
  std::array<float, 3> expected{};  // likewise, given the axes before
  std::array<float, 3> variance{};  // likewise
  float second_from_first = 0.0F;   // regression on the errors before
  float third_from_first = 0.0F;
  float third_from_second = 0.0F;

  // Takes the value at a place into account.
  template <std::size_t place>
  void learn(float value) {
    const float error = value - mean[place];
    if constexpr (place == 0) {
      expected[1] += second_from_first * error;
      expected[2] += third_from_first * error;
    } else if constexpr (place == 1) {
      expected[2] += third_from_second * error;
    }
  }
};

inline void chain_axes(const Prediction& prediction, Float4 normal, const AxisUnits& units, AxisChain& chain) {
  // Which axis is last: the first of the largest. Looked up, since a branch on it would be a coin toss.
  struct Order {
    std::array<int, 3> axes;
    Uint4 x_last;
    Uint4 y_last;
  };
  constexpr Uint4 kYes = {~0U, ~0U, ~0U, ~0U};
  constexpr Uint4 kNo = {};
  static constexpr std::array<Order, 4> kOrders = {
      {{{1, 2, 0}, kYes, kNo}, {{2, 0, 1}, kNo, kYes}, {{0, 1, 2}, kNo, kNo}, {{0, 1, 2}, kNo, kNo}}};
  const float nx = std::fabs(normal[0]);
  const float ny = std::fabs(normal[1]);
  const float nz = std::fabs(normal[2]);
  const Order& order = kOrders[static_cast<std::size_t>(ny > nx) + 2 * static_cast<std::size_t>(nz > std::max(nx, ny))];
  chain.order = order.axes;
  const auto ordered = [&](Float4 v) {
    const Float4 x_last = __builtin_shufflevector(v, v, 1, 2, 0, 3);
    const Float4 y_last = __builtin_shufflevector(v, v, 2, 0, 1, 3);
    return chosen(order.x_last, x_last, chosen(order.y_last, y_last, v));
  };
  const Float4 per_unit = ordered(units.reciprocal);
  const Float4 mean = ordered(prediction.mean) * per_unit;
  const Float4 n = ordered(normal) * per_unit;
  const Float4 a = ordered(prediction.along) * per_unit;
  const float length2 = dot3(prediction.along, prediction.along);
  const float across2 = prediction.variance_across;
  const float normal2 = prediction.variance_normal - across2;
  const float along2 = length2 > 0.0F ? (prediction.variance_along - across2) / length2 : 0.0F;
  const Float4 scaled_n = float4(normal2) * n;
  const Float4 scaled_a = float4(along2) * a;
  const Float4 diagonal = (scaled_n * n + scaled_a * a) + float4(across2) * (per_unit * per_unit);
  const Float4 beside = scaled_n * rotate_axes(n) + scaled_a * rotate_axes(a);  // xy, yz, zx
  constexpr float kLeast = 1.0e-4F;                                             // variances, in code steps squared
  const float xx = std::max(diagonal[0], kLeast);
  const float xy = beside[0];
  const float xz = beside[2];
  const float per_xx = 1.0F / xx;
  chain.second_from_first = xy * per_xx;
  const float yy = std::max(diagonal[1] - xy * chain.second_from_first, kLeast);
  const float yz = beside[1] - xz * chain.second_from_first;
  chain.third_from_second = yz / yy;
  const float z_from_x = xz * per_xx;
  chain.third_from_first = z_from_x - chain.third_from_second * chain.second_from_first;
  const float zz = std::max((diagonal[2] - xz * z_from_x) - yz * chain.third_from_second, kLeast);
  chain.mean = chain.expected = {mean[0], mean[1], mean[2]};
  chain.variance = {xx, yy, zz};
}

}  // namespace fanstream
