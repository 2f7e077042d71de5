#include "client/render/image_difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace fanstream {

Result<ImageDifference> compare_images(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height || a.rgba.size() != b.rgba.size() || a.rgba.empty()) {
    return fail(ErrorKind::usage, fmt::format("images of {}x{} and {}x{} pixels cannot be compared", a.width, a.height,
                                              b.width, b.height));
  }
  ImageDifference difference;
  std::uint64_t squares = 0;
  std::size_t differing = 0;
  for (std::size_t i = 0; i < a.rgba.size(); i += 4) {
    int largest = 0;
    for (std::size_t channel = 0; channel < 4; ++channel) {
      const int d = std::abs(int{a.rgba[i + channel]} - int{b.rgba[i + channel]});
      largest = std::max(largest, d);
      if (channel < 3) squares += static_cast<std::uint64_t>(d * d);
    }
    differing += largest > 0 ? 1 : 0;
    difference.largest_difference = std::max(difference.largest_difference, static_cast<std::uint8_t>(largest));
  }
  const auto pixels = static_cast<double>(a.rgba.size() / 4);
  difference.differing_share = static_cast<double>(differing) / pixels;
  difference.psnr_db = squares == 0 ? std::numeric_limits<double>::infinity()
                                    : 10.0 * std::log10(255.0 * 255.0 * 3.0 * pixels / static_cast<double>(squares));
  return difference;
}

}  // namespace fanstream
