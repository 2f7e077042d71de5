#include "client/render/animated_png.h"

#include <gtest/gtest.h>
#include <png.h>
#include <zlib.h>

#include <cstring>

#include "client/render/image_difference.h"
#include "tests/support/seeded_random.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using testing::SeededRandom;
using Buffer = std::vector<std::uint8_t>;

struct Chunk {
  std::string type;
  Buffer data;
};

std::uint32_t u32(const Buffer& data, std::size_t at) {
  return std::uint32_t{data[at]} << 24U | std::uint32_t{data[at + 1]} << 16U | std::uint32_t{data[at + 2]} << 8U |
         data[at + 3];
}

void append_u32(Buffer& out, std::uint32_t v) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(v >> shift));
}

// Every chunk, its checksum compared.
std::vector<Chunk> chunks_of(const Buffer& file) {
  std::vector<Chunk> chunks;
  EXPECT_EQ(std::memcmp(file.data(), "\x89PNG\r\n\x1A\n", 8), 0);
  std::size_t at = 8;
  while (at + 12 <= file.size()) {
    const std::uint32_t size = u32(file, at);
    Chunk chunk{std::string(file.begin() + static_cast<std::ptrdiff_t>(at + 4),
                            file.begin() + static_cast<std::ptrdiff_t>(at + 8)),
                Buffer(file.begin() + static_cast<std::ptrdiff_t>(at + 8),
                       file.begin() + static_cast<std::ptrdiff_t>(at + 8 + size))};
    EXPECT_EQ(crc32(0, file.data() + at + 4, size + 4), u32(file, at + 8 + size)) << chunk.type;
    at += 12 + size;
    chunks.push_back(std::move(chunk));
  }
  EXPECT_EQ(at, file.size());
  return chunks;
}

struct PlayedFrame {
  Image image;
  std::uint32_t delay_ms = 0;
  std::uint32_t rectangle_pixels = 0;
};

// One frame's data as a PNG file of its own, read by libpng.
Image decode(const Buffer& header, std::uint32_t width, std::uint32_t height, const Buffer& deflated) {
  Buffer file{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  const auto put = [&file](const char* type, const Buffer& data) {
    append_u32(file, static_cast<std::uint32_t>(data.size()));
    const std::size_t begin = file.size();
    file.insert(file.end(), type, type + 4);
    file.insert(file.end(), data.begin(), data.end());
    append_u32(file, static_cast<std::uint32_t>(crc32(0, file.data() + begin, static_cast<uInt>(file.size() - begin))));
  };
  Buffer sized;
  append_u32(sized, width);
  append_u32(sized, height);
  sized.insert(sized.end(), header.begin() + 8, header.end());
  put("IHDR", sized);
  put("IDAT", deflated);
  put("IEND", {});
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&png, file.data(), file.size()), 0) << png.message;
  png.format = PNG_FORMAT_RGBA;
  Image image{png.width, png.height, Buffer(PNG_IMAGE_SIZE(png))};
  EXPECT_NE(png_image_finish_read(&png, nullptr, image.rgba.data(), 0, nullptr), 0) << png.message;
  return image;
}

// As a browser does it: each frame's rectangle replaces what the frame before left.
std::vector<PlayedFrame> play(const Buffer& file) {
  const std::vector<Chunk> chunks = chunks_of(file);
  std::vector<PlayedFrame> frames;
  EXPECT_EQ(chunks.front().type, "IHDR");
  EXPECT_EQ(chunks.back().type, "IEND");
  const Buffer& header = chunks.front().data;
  Image canvas = Image::filled(u32(header, 0), u32(header, 4), {0, 0, 0, 0});
  Buffer control;
  std::uint32_t sequence = 0;
  std::uint32_t promised = 0;
  for (const Chunk& chunk : chunks) {
    if (chunk.type == "acTL") promised = u32(chunk.data, 0);
    if (chunk.type == "fcTL" || chunk.type == "fdAT") {
      EXPECT_EQ(u32(chunk.data, 0), sequence++);
    }
    if (chunk.type == "fcTL") control = chunk.data;
    if (chunk.type != "IDAT" && chunk.type != "fdAT") continue;
    EXPECT_EQ(chunk.type == "IDAT", frames.empty());
    const std::uint32_t width = u32(control, 4);
    const std::uint32_t height = u32(control, 8);
    const std::uint32_t x = u32(control, 12);
    const std::uint32_t y = u32(control, 16);
    EXPECT_LE(x + width, canvas.width);
    EXPECT_LE(y + height, canvas.height);
    EXPECT_EQ(control[22] << 8 | control[23], 1000);
    EXPECT_EQ(control[24] | control[25], 0);  // stays, replaces
    const Buffer data(chunk.data.begin() + (chunk.type == "fdAT" ? 4 : 0), chunk.data.end());
    const Image part = decode(header, width, height, data);
    for (std::uint32_t row = 0; row < height; ++row) {
      std::copy_n(part.pixel(0, row), 4 * std::size_t{width}, canvas.pixel(x, y + row));
    }
    frames.push_back({canvas, static_cast<std::uint32_t>(control[20] << 8 | control[21]), width * height});
  }
  EXPECT_EQ(frames.size(), promised);
  return frames;
}

Image noise(std::uint32_t width, std::uint32_t height, SeededRandom& random, bool opaque) {
  Image image = Image::filled(width, height, {0, 0, 0, 255});
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    if (!opaque || i % 4 != 3) image.rgba[i] = static_cast<std::uint8_t>(random.below(256));
  }
  return image;
}

TEST(AnimatedPng, GivesBackEveryPixelOfEveryFrame) {
  for (const bool alpha : {false, true}) {
    for (const auto& [width, height] : {std::pair{1U, 1U}, {7U, 3U}, {64U, 65U}}) {
      SeededRandom random(width);
      AnimatedPng animation(AnimatedPngOptions{3, alpha});
      std::vector<Image> images;
      for (std::uint32_t i = 0; i < 5; ++i) {
        images.push_back(noise(width, height, random, !alpha));
        const Result<void> added = animation.add(images.back(), 10 + i);
        ASSERT_TRUE(added) << added.error().message;
      }
      const Result<Buffer> file = animation.encode();
      ASSERT_TRUE(file) << file.error().message;
      const std::vector<PlayedFrame> frames = play(*file);
      ASSERT_EQ(frames.size(), images.size());
      for (std::size_t i = 0; i < frames.size(); ++i) {
        EXPECT_EQ(compare_images(frames[i].image, images[i])->differing_share, 0.0) << "frame " << i;
        EXPECT_EQ(frames[i].delay_ms, 10 + i);
      }
    }
  }
}

// What a program that knows nothing of APNG shows.
TEST(AnimatedPng, IsAPngOfTheFirstFrame) {
  SeededRandom random(4);
  const Image first = noise(20, 10, random, true);
  AnimatedPng animation;
  ASSERT_TRUE(animation.add(first, 40));
  ASSERT_TRUE(animation.add(noise(20, 10, random, true), 40));
  const Buffer file = animation.encode().value();
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_memory(&png, file.data(), file.size()), 0) << png.message;
  png.format = PNG_FORMAT_RGBA;
  Image image{png.width, png.height, Buffer(PNG_IMAGE_SIZE(png))};
  ASSERT_NE(png_image_finish_read(&png, nullptr, image.rgba.data(), 0, nullptr), 0) << png.message;
  EXPECT_EQ(compare_images(image, first)->differing_share, 0.0);
}

TEST(AnimatedPng, StoresOnlyWhatChanges) {
  AnimatedPng animation;
  Image image = Image::filled(100, 80, {10, 20, 30, 255});
  ASSERT_TRUE(animation.add(image, 40));
  const Image first = image;
  ASSERT_TRUE(animation.add(image, 40));
  ASSERT_TRUE(animation.add(image, 15));
  image.pixel(30, 20)[0] = 99;
  image.pixel(33, 29)[2] = 99;
  ASSERT_TRUE(animation.add(image, 40));
  ASSERT_TRUE(animation.add(first, 40));
  const std::vector<PlayedFrame> frames = play(animation.encode().value());
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].delay_ms, 95U);
  EXPECT_EQ(frames[1].rectangle_pixels, 4U * 10U);
  EXPECT_EQ(compare_images(frames[1].image, image)->differing_share, 0.0);
  EXPECT_EQ(compare_images(frames[2].image, first)->differing_share, 0.0);
}

TEST(AnimatedPng, StillScenesLastAsLongAsTheyShould) {
  AnimatedPng animation;
  const Image image = Image::filled(5, 5, {1, 2, 3, 255});
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(animation.add(image, 45'000));
  std::uint64_t shown_ms = 0;
  for (const PlayedFrame& frame : play(animation.encode().value())) {
    shown_ms += frame.delay_ms;
    EXPECT_EQ(compare_images(frame.image, image)->differing_share, 0.0);
  }
  EXPECT_EQ(shown_ms, 450'000U);
}

TEST(AnimatedPng, RefusesWhatItCannotHoldAndKeepsTheRest) {
  AnimatedPng animation;
  EXPECT_EQ(animation.encode().error().kind, ErrorKind::usage);
  EXPECT_EQ(animation.add(Image{}, 40).error().kind, ErrorKind::usage);
  EXPECT_EQ(animation.add(Image::filled(20'000, 1, {0, 0, 0, 255}), 40).error().kind, ErrorKind::limit);
  ASSERT_TRUE(animation.add(Image::filled(8, 8, {0, 0, 0, 255}), 40));
  const Buffer before = animation.encode().value();
  EXPECT_EQ(animation.add(Image::filled(8, 9, {0, 0, 0, 255}), 40).error().kind, ErrorKind::usage);
  EXPECT_EQ(animation.add(Image{8, 8, Buffer(5)}, 40).error().kind, ErrorKind::usage);
  EXPECT_EQ(animation.add(Image::filled(8, 8, {9, 9, 9, 255}), 0).error().kind, ErrorKind::usage);
  EXPECT_EQ(animation.add(Image::filled(8, 8, {9, 9, 9, 255}), 60'001).error().kind, ErrorKind::usage);
  EXPECT_EQ(animation.encode().value(), before);
}

TEST(AnimatedPng, IsWrittenAsAFile) {
  const testing::TemporaryFolder folder;
  AnimatedPng animation;
  ASSERT_TRUE(animation.add(Image::filled(8, 8, {0, 0, 0, 255}), 40));
  ASSERT_TRUE(animation.write(folder.path() / "a.png"));
  EXPECT_EQ(std::filesystem::file_size(folder.path() / "a.png"), animation.encode()->size());
  EXPECT_EQ(animation.write(folder.path() / "none" / "a.png").error().kind, ErrorKind::io);
}

}  // namespace
}  // namespace fanstream
