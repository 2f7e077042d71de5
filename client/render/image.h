// Pictures in memory and as PNG files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/support/result.h"

namespace fanstream {

// Eight bits a channel, red green blue alpha, sRGB, rows from the top, no padding.
struct Image {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> rgba;  // 4 * width * height

  static Image filled(std::uint32_t width, std::uint32_t height, std::array<std::uint8_t, 4> color);
  std::uint8_t* pixel(std::uint32_t x, std::uint32_t y) { return rgba.data() + 4 * (std::size_t{y} * width + x); }
  const std::uint8_t* pixel(std::uint32_t x, std::uint32_t y) const {
    return rgba.data() + 4 * (std::size_t{y} * width + x);
  }
};

// Fails (usage) for an empty image or one whose bytes do not fit its size.
Result<std::vector<std::uint8_t>> encode_png(const Image& image);

// As write_file_atomically: a failure leaves what was there before.
Result<void> write_png(const Image& image, const std::filesystem::path& path);

}  // namespace fanstream
