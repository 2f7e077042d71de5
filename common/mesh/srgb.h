// Between the numbers that files of eight bits a channel hold and linear light (IEC 61966-2-1).
#pragma once

#include <algorithm>
#include <cmath>

namespace fanstream {

// Both map [0, 1] onto itself and go on as they do at the ends outside of it.
inline float linear_of_srgb(float x) { return x <= 0.04045F ? x / 12.92F : std::pow((x + 0.055F) / 1.055F, 2.4F); }
inline float srgb_of_linear(float x) {
  return x <= 0.0031308F ? x * 12.92F : 1.055F * std::pow(x, 1.0F / 2.4F) - 0.055F;
}

}  // namespace fanstream
