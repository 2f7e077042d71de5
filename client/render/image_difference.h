// How far apart two pictures of the same size are.
#pragma once

#include "client/render/image.h"

namespace fanstream {

struct ImageDifference {
  double psnr_db = 0.0;                 // over red, green and blue; infinite where the pictures are equal
  double differing_share = 0.0;         // share of pixels that differ in any channel, 0 to 1
  std::uint8_t largest_difference = 0;  // of any channel
};

// Alpha counts for differing_share and largest_difference only. Fails (usage) where the sizes differ.
Result<ImageDifference> compare_images(const Image& a, const Image& b);

}  // namespace fanstream
