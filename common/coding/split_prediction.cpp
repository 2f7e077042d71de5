#include "common/coding/split_coder.h"

namespace fanstream {
namespace {

// 2^(eighths/8), exactly the same everywhere.
float power_of_eighths(int eighths) {
  static constexpr std::array<float, 8> kSteps = {1.0F,       1.09050773F, 1.18920712F, 1.29683955F,
                                                  1.41421356F, 1.54221083F, 1.68179283F, 1.83400809F};
  const int octave = eighths >> 3;
  return std::ldexp(kSteps[static_cast<std::size_t>(eighths & 7)], octave);
}

}  // namespace

RingFeatures ring_features(const RingGeometry& ring, const FanSplit& split) {
  const std::uint32_t size = ring.size();
  std::uint32_t first = split.first;
  std::uint32_t last = split.last;
  if (split.parent == ParentPosition::added) std::swap(first, last);
  RingFeatures result;
  result.middle = split.parent == ParentPosition::middle;
  result.arc = last > first ? last - first : last + size - first;
  glm::vec3 inside(0.0F);
  glm::vec3 outside(0.0F);
  std::uint32_t inside_count = result.arc - 1;
  std::uint32_t outside_count = size - result.arc - 1;
  std::uint32_t at = ring.wrap(first + 1);
  for (std::uint32_t i = 1; i < result.arc; ++i, at = ring.wrap(at + 1)) inside += ring.spoke(at);
  at = ring.wrap(at + 1);
  for (; at != first; at = ring.wrap(at + 1)) outside += ring.spoke(at);
  glm::vec3 wings = 0.5F * (ring.spoke(first) + ring.spoke(last));
  if (ring.is_open()) {
    if (ring.gap() == first || ring.gap() == last) {
      wings *= 2.0F;
    } else if ((ring.gap() + size - first) % size < result.arc) {
      --inside_count;
    } else {
      --outside_count;
    }
  }
  if (inside_count > 0) inside *= 1.0F / static_cast<float>(inside_count);
  if (outside_count > 0) outside *= 1.0F / static_cast<float>(outside_count);
  glm::vec3 ends(0.0F);
  if (result.arc >= 2) ends = 0.5F * (ring.spoke(ring.wrap(first + 1)) + ring.spoke(ring.wrap(last + size - 1)));
  result.features = {inside, wings, outside, ends};
  return result;
}

Prediction predict(const SplitModel& model, const RingGeometry& ring, const RingFeatures& features) {
  const auto context = static_cast<std::size_t>(PredictionContexts::index(features.middle, ring.is_open(), features.arc));
  Prediction result;
  for (std::size_t f = 0; f < features.features.size(); ++f) {
    result.mean += (static_cast<float>(model.weights[context][f]) * (1.0F / 64.0F)) * features.features[f];
  }
  const glm::vec3& n = ring.normal();
  const glm::vec3 tangential = result.mean - glm::dot(result.mean, n) * n;
  const float length2 = glm::dot(tangential, tangential);
  if (length2 > 0.0F) result.along = tangential * (1.0F / std::sqrt(length2));
  const int size = SpreadContexts::size_class(ring.mean_length());
  const int shift = features.middle ? model.spreads[SpreadContexts::kMiddleShift] : 0;
  const auto spread = [&](int index) { return power_of_eighths(model.spreads[static_cast<std::size_t>(index)] + shift); };
  result.spread_along = spread(SpreadContexts::kAlong + size);
  result.spread_across = spread(SpreadContexts::kAcross + size);
  result.spread_normal = spread(SpreadContexts::normal(ring.bend(), ring.mean_length()));
  return result;
}

AxisChain chain_axes(const Prediction& prediction, const glm::vec3& normal, const glm::vec3& unit) {
  AxisChain chain;
  const glm::vec3 per_step = 1.0F / unit;
  chain.mean = prediction.mean * per_step;
  const glm::vec3 n = normal * per_step;
  const glm::vec3 a = prediction.along * per_step;
  const float across2 = prediction.spread_across * prediction.spread_across;
  const float normal2 = prediction.spread_normal * prediction.spread_normal - across2;
  const float along2 = prediction.spread_along * prediction.spread_along - across2;
  const auto covariance = [&](int i, int j) {
    const float isotropic = i == j ? across2 * per_step[i] * per_step[i] : 0.0F;
    return isotropic + normal2 * n[i] * n[j] + along2 * a[i] * a[j];
  };
  int last = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (std::fabs(normal[axis]) > std::fabs(normal[last])) last = axis;
  }
  chain.order = {(last + 1) % 3, (last + 2) % 3, last};
  const auto [x, y, z] = chain.order;
  constexpr float kLeast = 1.0e-4F;  // variances, in code steps squared
  const float xx = std::max(covariance(x, x), kLeast);
  const float xy = covariance(x, y);
  const float xz = covariance(x, z);
  chain.second_from_first = xy / xx;
  const float yy = std::max(covariance(y, y) - xy * chain.second_from_first, kLeast);
  const float yz = covariance(y, z) - xz * chain.second_from_first;
  chain.third_from_second = yz / yy;
  chain.third_from_first = xz / xx - chain.third_from_second * chain.second_from_first;
  const float zz = std::max(covariance(z, z) - xz * xz / xx - yz * chain.third_from_second, kLeast);
  chain.spread = {std::sqrt(xx), std::sqrt(yy), std::sqrt(zz)};
  return chain;
}

}  // namespace fanstream
