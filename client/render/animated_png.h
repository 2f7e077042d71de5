// Animated PNG files (APNG, part of PNG's third edition): every browser plays them, every other program shows the first
// picture.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "client/render/image.h"

namespace fanstream {

struct AnimatedPngOptions {
  std::uint32_t plays = 0;  // how often it is played; 0: for ever
  bool alpha = false;       // false: pictures are taken as opaque, which saves a channel
};

// Takes the frames one by one and keeps them compressed: of each only the rectangle in which it differs from the frame
// before, and nothing of one that does not differ, which then is shown for so much longer. Not thread safe.
class AnimatedPng {
 public:
  static constexpr std::uint32_t kLargestSidePx = 16'384;
  static constexpr std::uint64_t kMostPixels = 64'000'000;
  static constexpr std::size_t kMostFrames = 100'000;
  static constexpr std::size_t kMostBytes = 1U << 30;  // compressed
  static constexpr std::uint32_t kLongestDelayMs = 60'000;

  explicit AnimatedPng(const AnimatedPngOptions& options = {}) : options_(options) {}

  // The next frame, shown for delay_ms (1 to kLongestDelayMs). Fails (usage) for an image without pixels, of another
  // size than the first, or a delay out of range, (limit) where the limits are reached; what was added before stays
  // whole.
  Result<void> add(const Image& image, std::uint32_t delay_ms);
  std::size_t frame_count() const { return frames_.size(); }  // stored, those that differ
  std::size_t size_bytes() const { return size_bytes_; }      // about, of the file

  // The file. Fails (usage) without frames.
  Result<std::vector<std::uint8_t>> encode() const;
  // As write_file_atomically.
  Result<void> write(const std::filesystem::path& path) const;

 private:
  struct Frame {
    std::uint32_t x = 0, y = 0, width = 0, height = 0;
    std::uint32_t delay_ms = 0;
    std::vector<std::uint8_t> deflated;  // as in IDAT
  };

  Result<void> check(const Image& image, std::uint32_t delay_ms) const;
  Frame changed_part(const Image& image) const;
  Result<void> compress(const Image& image, Frame& frame) const;

  AnimatedPngOptions options_;
  std::vector<Frame> frames_;
  Image last_;
  std::size_t size_bytes_ = 0;
};

}  // namespace fanstream
