#include "common/coding/split_coder.h"

namespace fanstream {
RingFeatures ring_features(const RingGeometry& ring, const FanSplit& split) {
  const std::uint32_t size = ring.size();
  std::uint32_t first = split.first;
  std::uint32_t last = split.last;
  if (split.parent == ParentPosition::added) std::swap(first, last);
  RingFeatures result;
  result.middle = split.parent == ParentPosition::middle;
  result.arc = last > first ? last - first : last + size - first;
  Float4 inside{};
  Float4 outside{};
  std::uint32_t inside_count = result.arc - 1;
  std::uint32_t outside_count = size - result.arc - 1;
  std::uint32_t at = ring.wrap(first + 1);
  for (std::uint32_t i = 1; i < result.arc; ++i, at = ring.wrap(at + 1)) inside += ring.spoke(at);
  at = ring.wrap(at + 1);
  for (; at != first; at = ring.wrap(at + 1)) outside += ring.spoke(at);
  Float4 wings = float4(0.5F) * (ring.spoke(first) + ring.spoke(last));
  if (ring.is_open()) {
    if (ring.gap() == first || ring.gap() == last) {
      wings *= float4(2.0F);
    } else if ((ring.gap() + size - first) % size < result.arc) {
      --inside_count;
    } else {
      --outside_count;
    }
  }
  if (inside_count > 0) inside *= float4(1.0F / static_cast<float>(inside_count));
  if (outside_count > 0) outside *= float4(1.0F / static_cast<float>(outside_count));
  Float4 ends{};
  if (result.arc >= 2) {
    ends = float4(0.5F) * (ring.spoke(ring.wrap(first + 1)) + ring.spoke(last == 0 ? size - 1 : last - 1));
  }
  result.features = {inside, wings, outside, ends};
  return result;
}

Prediction predict(const SplitModel& model, const RingGeometry& ring, const RingFeatures& features) {
  const auto context = static_cast<std::size_t>(PredictionContexts::index(features.middle, ring.is_open(), features.arc));
  Prediction result;
  for (std::size_t f = 0; f < features.features.size(); ++f) {
    result.mean += float4(model.weights[context][f]) * features.features[f];
  }
  const Float4 n = ring.normal();
  const Float4 tangential = result.mean - float4(dot3(result.mean, n)) * n;
  const float length2 = dot3(tangential, tangential);
  if (length2 > 0.0F) result.along = tangential * float4(1.0F / std::sqrt(length2));
  const auto size = static_cast<std::size_t>(SpreadContexts::size_class(ring.mean_length()));
  const float scale = features.middle ? model.spreads[SpreadContexts::kMiddleShift] : 1.0F;
  result.spread_along = scale * model.spreads[SpreadContexts::kAlong + size];
  result.spread_across = scale * model.spreads[SpreadContexts::kAcross + size];
  result.spread_normal =
      scale * model.spreads[static_cast<std::size_t>(SpreadContexts::normal(ring.bend(), ring.mean_length()))];
  return result;
}

AxisChain chain_axes(const Prediction& prediction, Float4 normal, const glm::vec3& unit) {
  AxisChain chain;
  const Float4 per_step = Float4{1.0F, 1.0F, 1.0F, 0.0F} / Float4{unit.x, unit.y, unit.z, 1.0F};
  chain.mean = prediction.mean * per_step;
  int last = std::fabs(normal[1]) > std::fabs(normal[0]) ? 1 : 0;
  if (std::fabs(normal[2]) > std::fabs(normal[last])) last = 2;
  static constexpr std::array<std::array<int, 3>, 3> kOrders = {{{1, 2, 0}, {2, 0, 1}, {0, 1, 2}}};
  chain.order = kOrders[static_cast<std::size_t>(last)];
  const auto [x, y, z] = chain.order;
  const Float4 n = normal * per_step;
  const Float4 a = prediction.along * per_step;
  const float across2 = prediction.spread_across * prediction.spread_across;
  const float normal2 = prediction.spread_normal * prediction.spread_normal - across2;
  const float along2 = prediction.spread_along * prediction.spread_along - across2;
  const Float4 scaled_n = float4(normal2) * n;
  const Float4 scaled_a = float4(along2) * a;
  const Float4 diagonal = float4(across2) * per_step * per_step + scaled_n * n + scaled_a * a;
  const auto covariance = [&](int i, int j) { return scaled_n[i] * n[j] + scaled_a[i] * a[j]; };
  constexpr float kLeast = 1.0e-4F;  // variances, in code steps squared
  const float xx = std::max(diagonal[x], kLeast);
  const float xy = covariance(x, y);
  const float xz = covariance(x, z);
  chain.second_from_first = xy / xx;
  const float yy = std::max(diagonal[y] - xy * chain.second_from_first, kLeast);
  const float yz = covariance(y, z) - xz * chain.second_from_first;
  chain.third_from_second = yz / yy;
  chain.third_from_first = xz / xx - chain.third_from_second * chain.second_from_first;
  const float zz = std::max(diagonal[z] - xz * (xz / xx) - yz * chain.third_from_second, kLeast);
  chain.spread = {std::sqrt(xx), std::sqrt(yy), std::sqrt(zz)};
  return chain;
}

}  // namespace fanstream
