#include "client/render/image.h"

#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <random>

#include "client/render/contact_sheet.h"
#include "client/render/image_difference.h"
#include "client/render/text.h"

namespace fanstream {
namespace {

namespace fs = std::filesystem;

Image noise(std::uint32_t width, std::uint32_t height, std::uint32_t seed) {
  std::mt19937 random(seed);
  Image image = Image::filled(width, height, {0, 0, 0, 255});
  for (std::uint8_t& byte : image.rgba) byte = static_cast<std::uint8_t>(random());
  return image;
}

Image decode(const std::vector<std::uint8_t>& bytes) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()), 0) << png.message;
  png.format = PNG_FORMAT_RGBA;
  Image image{png.width, png.height, std::vector<std::uint8_t>(PNG_IMAGE_SIZE(png))};
  EXPECT_NE(png_image_finish_read(&png, nullptr, image.rgba.data(), 0, nullptr), 0) << png.message;
  return image;
}

// An empty directory that goes away with the test.
class Directory {
 public:
  Directory() : path(fs::temp_directory_path() / ("fanstream_image_test_" + std::to_string(::getpid()))) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Directory() { fs::remove_all(path); }
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;
  const fs::path path;
};

TEST(Png, GivesBackEveryPixel) {
  for (const auto& [width, height] : {std::pair{1U, 1U}, {7U, 3U}, {64U, 65U}}) {
    const Image image = noise(width, height, width);
    const auto encoded = encode_png(image);
    ASSERT_TRUE(encoded) << encoded.error().message;
    EXPECT_EQ(compare_images(image, decode(*encoded))->differing_share, 0.0);
  }
}

TEST(Png, RefusesImagesThatAreNone) {
  EXPECT_FALSE(encode_png(Image{}));
  EXPECT_FALSE(encode_png(Image{2, 2, std::vector<std::uint8_t>(15)}));
}

TEST(Png, IsWrittenWholeOverAnOldFileAndLeavesNothingElse) {
  const Directory directory;
  const fs::path path = directory.path / "picture.png";
  std::ofstream(path) << "old";
  const Image image = noise(40, 30, 1);
  const auto written = write_png(image, path);
  ASSERT_TRUE(written) << written.error().message;
  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(compare_images(image, decode(bytes))->differing_share, 0.0);
  EXPECT_EQ(std::distance(fs::directory_iterator(directory.path), {}), 1);
}

TEST(Png, ReportsWhereItCannotBeWritten) {
  const Directory directory;
  const Image image = noise(400, 300, 1);
  const auto full = write_png(image, "/dev/full");
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().kind, ErrorKind::io);
  EXPECT_NE(full.error().message.find("/dev/full: cannot write: No space left"), std::string::npos);
  EXPECT_TRUE(fs::is_character_file("/dev/full")) << "the device is still there";
  const auto missing = write_png(image, directory.path / "no" / "such.png");
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find("such.png"), std::string::npos);
  EXPECT_NE(missing.error().message.find("create the directory"), std::string::npos);
  EXPECT_FALSE(write_png(image, directory.path));
}

TEST(ImageDifference, MeasuresWhatDiffers) {
  const Image black = Image::filled(10, 10, {0, 0, 0, 255});
  Image one = black;
  one.pixel(3, 4)[1] = 100;
  const auto difference = compare_images(black, one);
  ASSERT_TRUE(difference);
  EXPECT_DOUBLE_EQ(difference->differing_share, 0.01);
  EXPECT_EQ(difference->largest_difference, 100);
  EXPECT_NEAR(difference->psnr_db, 10 * std::log10(255.0 * 255.0 / (100.0 * 100.0 / 300.0)), 1e-9);
  EXPECT_TRUE(std::isinf(compare_images(black, black)->psnr_db));
  EXPECT_NEAR(compare_images(black, Image::filled(10, 10, {255, 255, 255, 255}))->psnr_db, 0.0, 1e-9);
  EXPECT_FALSE(compare_images(black, Image::filled(10, 11, {0, 0, 0, 255})));
  EXPECT_FALSE(compare_images(Image{}, Image{}));
}

TEST(Text, IsAsWideAsItSaysAndStaysInTheImage) {
  const std::string text = "level 3  412 KB  12,345 vertices";
  const double width = text_width_px(text, 17);
  EXPECT_GT(width, 150.0);
  EXPECT_GT(text_width_px(text + "i", 17), width);
  const Image paper = Image::filled(400, 40, {255, 255, 255, 255});
  Image image = paper;
  draw_text(image, text, 10, 10, 17, {0, 0, 0});
  std::uint32_t left = 400;
  std::uint32_t right = 0;
  for (std::uint32_t y = 0; y < 40; ++y) {
    for (std::uint32_t x = 0; x < 400; ++x) {
      if (image.pixel(x, y)[0] > 128) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      EXPECT_TRUE(y >= 10 && y < 28) << y;
    }
  }
  EXPECT_NEAR(left, 10.0, 3.0);
  EXPECT_NEAR(right, 10.0 + width, 3.0);
  Image clipped = paper;
  draw_text(clipped, text, -50, -5, 17, {0, 0, 0});
  draw_text(clipped, text, 350, 35, 40, {0, 0, 0});
  draw_text(clipped, "\xFF\xC3 \xE2\x82 \xF0\x9F\x98\x80", 100, 10, 17, {0, 0, 0});
  EXPECT_GT(compare_images(paper, clipped)->differing_share, 0.0);
}

TEST(ContactSheet, ShowsEveryImageUnchangedWithItsCaption) {
  std::vector<ContactSheetEntry> entries;
  for (std::uint32_t i = 0; i < 5; ++i) {
    entries.push_back({Image::filled(120, 90, {static_cast<std::uint8_t>(10 + i), 0, 0, 255}),
                       {"level", "a very long caption line that cannot fit"}});
  }
  const auto sheet = make_contact_sheet(entries, {.title = "Five levels", .columns = 2});
  ASSERT_TRUE(sheet) << sheet.error().message;
  EXPECT_EQ(sheet->width, 2 * (120 + 16) + 16U);
  std::array<std::size_t, 5> found{};
  for (std::size_t i = 0; i < sheet->rgba.size(); i += 4) {
    const int red = sheet->rgba[i];
    if (sheet->rgba[i + 1] == 0 && sheet->rgba[i + 2] == 0 && red >= 10 && red < 15)
      ++found[static_cast<std::size_t>(red - 10)];
  }
  for (const std::size_t pixels : found) EXPECT_EQ(pixels, 120U * 90U);
}

TEST(ContactSheet, RefusesWhatMakesNoGrid) {
  const Image image = Image::filled(100, 100, {0, 0, 0, 255});
  EXPECT_FALSE(make_contact_sheet({}));
  EXPECT_FALSE(make_contact_sheet({{image, {}}, {Image::filled(100, 99, {0, 0, 0, 255}), {}}}));
  EXPECT_FALSE(make_contact_sheet({{Image{}, {}}}));
  const auto huge = make_contact_sheet(std::vector<ContactSheetEntry>(200, {image, {}}), {.columns = 200});
  ASSERT_FALSE(huge);
  EXPECT_EQ(huge.error().kind, ErrorKind::limit);
}

}  // namespace
}  // namespace fanstream
