#include "client/render/animated_png.h"

#include <fmt/format.h>
#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <string_view>

#include "common/support/atomic_file.h"

namespace fanstream {
namespace {

using Buffer = std::vector<std::uint8_t>;

constexpr std::size_t kSignatureBytes = 8;
constexpr std::size_t kChunkExtraBytes = 12;  // length, type, checksum
constexpr std::size_t kFrameExtraBytes = 64;  // fcTL, and what goes around the data

void put_u16(Buffer& out, std::uint32_t v) {
  out.push_back(static_cast<std::uint8_t>(v >> 8U));
  out.push_back(static_cast<std::uint8_t>(v));
}
void put_u32(Buffer& out, std::uint32_t v) {
  put_u16(out, v >> 16U);
  put_u16(out, v & 0xFFFFU);
}
std::uint32_t get_u32(const std::uint8_t* at) {
  return std::uint32_t{at[0]} << 24U | std::uint32_t{at[1]} << 16U | std::uint32_t{at[2]} << 8U | at[3];
}

void put_chunk(Buffer& out, std::string_view type, std::span<const std::uint8_t> data) {
  put_u32(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = out.size();
  out.insert(out.end(), type.begin(), type.end());
  out.insert(out.end(), data.begin(), data.end());
  put_u32(out, static_cast<std::uint32_t>(crc32(0, out.data() + begin, static_cast<uInt>(out.size() - begin))));
}

// Everything in the IDAT chunks of a PNG file that libpng has just written.
Buffer image_data(const Buffer& png) {
  Buffer data;
  for (std::size_t at = kSignatureBytes; at + kChunkExtraBytes <= png.size();) {
    const std::size_t size = get_u32(png.data() + at);
    const std::uint8_t* chunk = png.data() + at + 8;
    if (std::memcmp(chunk - 4, "IDAT", 4) == 0) data.insert(data.end(), chunk, chunk + size);
    at += size + kChunkExtraBytes;
  }
  return data;
}

bool same_pixels(const Image& a, const Image& b, std::size_t first_pixel, std::size_t count, bool alpha) {
  if (alpha) return std::memcmp(&a.rgba[4 * first_pixel], &b.rgba[4 * first_pixel], 4 * count) == 0;
  for (std::size_t i = 4 * first_pixel; i < 4 * (first_pixel + count); i += 4) {
    if (std::memcmp(&a.rgba[i], &b.rgba[i], 3) != 0) return false;
  }
  return true;
}

}  // namespace

Result<void> AnimatedPng::check(const Image& image, std::uint32_t delay_ms) const {
  const std::uint64_t pixels = std::uint64_t{image.width} * image.height;
  if (pixels == 0 || image.rgba.size() != 4 * pixels) return fail(ErrorKind::usage, "animated PNG: not an image");
  if (delay_ms == 0 || delay_ms > kLongestDelayMs) {
    return fail(ErrorKind::usage,
                fmt::format("animated PNG: a frame for {} ms; 1 to {} can be had", delay_ms, kLongestDelayMs));
  }
  if (!frames_.empty() && (image.width != last_.width || image.height != last_.height)) {
    return fail(ErrorKind::usage, fmt::format("animated PNG: a frame of {}x{} pixels, the first has {}x{}", image.width,
                                              image.height, last_.width, last_.height));
  }
  if (image.width > kLargestSidePx || image.height > kLargestSidePx || pixels > kMostPixels) {
    return fail(ErrorKind::limit, fmt::format("animated PNG: {}x{} pixels are too many", image.width, image.height));
  }
  return {};
}

// The box around all pixels that are not as in the frame before; empty where there are none.
AnimatedPng::Frame AnimatedPng::changed_part(const Image& image) const {
  if (frames_.empty()) return {0, 0, image.width, image.height, 0, {}};
  const auto row_same = [&](std::uint32_t y) {
    return same_pixels(image, last_, std::size_t{y} * image.width, image.width, options_.alpha);
  };
  std::uint32_t top = 0;
  while (top < image.height && row_same(top)) ++top;
  if (top == image.height) return {};
  std::uint32_t bottom = image.height;
  while (row_same(bottom - 1)) --bottom;
  std::uint32_t left = image.width;
  std::uint32_t right = 0;
  for (std::uint32_t y = top; y < bottom; ++y) {
    const auto same = [&](std::uint32_t x) {
      return same_pixels(image, last_, std::size_t{y} * image.width + x, 1, options_.alpha);
    };
    for (std::uint32_t x = 0; x < left; ++x) {
      if (!same(x)) left = x;
    }
    for (std::uint32_t x = image.width; x > right; --x) {
      if (!same(x - 1)) right = x;
    }
  }
  return {left, top, right - left, bottom - top, 0, {}};
}

Result<void> AnimatedPng::compress(const Image& image, Frame& frame) const {
  const std::size_t channels = options_.alpha ? 4 : 3;
  Buffer pixels;
  pixels.reserve(channels * frame.width * frame.height);
  for (std::uint32_t y = 0; y < frame.height; ++y) {
    const std::uint8_t* row = image.pixel(frame.x, frame.y + y);
    for (std::uint32_t x = 0; x < frame.width; ++x) pixels.insert(pixels.end(), row + 4 * x, row + 4 * x + channels);
  }
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = frame.width;
  png.height = frame.height;
  png.format = options_.alpha ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  Buffer encoded(PNG_IMAGE_PNG_SIZE_MAX(png));
  png_alloc_size_t encoded_bytes = encoded.size();
  if (png_image_write_to_memory(&png, encoded.data(), &encoded_bytes, 0, pixels.data(), 0, nullptr) == 0) {
    const std::string message = fmt::format("animated PNG: {}", png.message);
    png_image_free(&png);
    return fail(ErrorKind::io, message);
  }
  encoded.resize(encoded_bytes);
  frame.deflated = image_data(encoded);
  return {};
}

Result<void> AnimatedPng::add(const Image& image, std::uint32_t delay_ms) {
  if (const auto checked = check(image, delay_ms); !checked) return checked;
  Frame frame = changed_part(image);
  if (frame.width == 0) {
    Frame& shown = frames_.back();
    if (shown.delay_ms + delay_ms <= kLongestDelayMs) {
      shown.delay_ms += delay_ms;
      return {};
    }
    frame = {0, 0, 1, 1, 0, {}};  // one frame cannot be shown so long: a pixel of it once more
  }
  if (frames_.size() == kMostFrames) {
    return fail(ErrorKind::limit, fmt::format("animated PNG: more than {} frames", kMostFrames));
  }
  frame.delay_ms = delay_ms;
  if (const auto compressed = compress(image, frame); !compressed) return compressed;
  const std::size_t more_bytes = frame.deflated.size() + kFrameExtraBytes;
  if (size_bytes_ + more_bytes > kMostBytes) {
    return fail(ErrorKind::limit,
                fmt::format("animated PNG: larger than {} bytes; use fewer or smaller frames", kMostBytes));
  }
  size_bytes_ += more_bytes;
  frames_.push_back(std::move(frame));
  last_ = image;
  return {};
}

Result<Buffer> AnimatedPng::encode() const {
  if (frames_.empty()) return fail(ErrorKind::usage, "animated PNG: no frames");
  Buffer out{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  out.reserve(size_bytes_ + 256);
  Buffer data;
  put_u32(data, last_.width);
  put_u32(data, last_.height);
  const std::uint8_t color_type = options_.alpha ? 6 : 2;
  data.insert(data.end(), {8, color_type, 0, 0, 0});  // bits a channel; compression, filters and interlacing as ever
  put_chunk(out, "IHDR", data);
  put_chunk(out, "sRGB", Buffer{0});  // perceptual
  data.clear();
  put_u32(data, static_cast<std::uint32_t>(frames_.size()));
  put_u32(data, options_.plays);
  put_chunk(out, "acTL", data);
  std::uint32_t sequence = 0;
  for (const Frame& frame : frames_) {
    data.clear();
    for (const std::uint32_t v : {sequence++, frame.width, frame.height, frame.x, frame.y}) put_u32(data, v);
    put_u16(data, frame.delay_ms);
    put_u16(data, 1000);              // of which the delay counts
    data.insert(data.end(), {0, 0});  // the frame stays; it replaces what was there
    put_chunk(out, "fcTL", data);
    if (&frame == &frames_.front()) {
      put_chunk(out, "IDAT", frame.deflated);
      continue;
    }
    data.clear();
    put_u32(data, sequence++);
    data.insert(data.end(), frame.deflated.begin(), frame.deflated.end());
    put_chunk(out, "fdAT", data);
  }
  put_chunk(out, "IEND", {});
  return out;
}

Result<void> AnimatedPng::write(const std::filesystem::path& path) const {
  const auto encoded = encode();
  if (!encoded) return tl::unexpected(with_context(encoded.error(), path.string()));
  return write_file_atomically(path, *encoded);
}

}  // namespace fanstream
