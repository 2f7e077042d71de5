#include "client/render/contact_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/render/text.h"

namespace fanstream {
namespace {

constexpr std::array<std::uint8_t, 4> kPaper{250, 250, 248, 255};
constexpr std::array<std::uint8_t, 3> kInk{28, 30, 34};
constexpr std::array<std::uint8_t, 3> kPaleInk{86, 90, 98};
constexpr std::uint64_t kLargestSide = 16384;
constexpr std::uint64_t kMostPixels = 64'000'000;
constexpr double kSmallestText = 8.0;
constexpr double kLineSpacing = 1.25;

struct Layout {
  std::uint64_t columns, rows, cell_width, cell_height, title_height, width, height;
};

Result<Layout> lay_out(const std::vector<ContactSheetEntry>& entries, const ContactSheetOptions& options) {
  if (entries.empty()) return fail(ErrorKind::usage, "contact sheet: no images");
  std::size_t lines = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Image& image = entries[i].image;
    const Image& first = entries[0].image;
    const bool whole = !image.rgba.empty() && image.rgba.size() == 4 * std::size_t{image.width} * image.height;
    if (!whole || image.width != first.width || image.height != first.height) {
      return fail(ErrorKind::usage, fmt::format("contact sheet: image {} is {}x{} pixels, the first {}x{}", i,
                                                image.width, image.height, first.width, first.height));
    }
    lines = std::max(lines, entries[i].caption.size());
  }
  const auto line_px = static_cast<std::uint64_t>(std::ceil(options.text_height_px * kLineSpacing));
  Layout sheet{};
  sheet.cell_width = entries[0].image.width;
  sheet.cell_height = entries[0].image.height + lines * line_px + (lines > 0 ? options.gap_px / 2 : 0);
  const double square =
      std::sqrt(static_cast<double>(entries.size() * sheet.cell_height) / static_cast<double>(sheet.cell_width));
  sheet.columns = options.columns > 0 ? options.columns : static_cast<std::uint64_t>(std::max(1L, std::lround(square)));
  sheet.columns = std::min<std::uint64_t>(sheet.columns, entries.size());
  sheet.rows = (entries.size() + sheet.columns - 1) / sheet.columns;
  sheet.title_height = options.title.empty() ? 0 : 2 * line_px;
  sheet.width = sheet.columns * (sheet.cell_width + options.gap_px) + options.gap_px;
  sheet.height = sheet.rows * (sheet.cell_height + options.gap_px) + options.gap_px + sheet.title_height;
  if (sheet.width > kLargestSide || sheet.height > kLargestSide || sheet.width * sheet.height > kMostPixels) {
    return fail(ErrorKind::limit, fmt::format("contact sheet: {}x{} pixels are too many; use fewer or smaller images",
                                              sheet.width, sheet.height));
  }
  return sheet;
}

void draw_line(Image& sheet, const std::string& text, double x, double y, double width, double height_px,
               std::array<std::uint8_t, 3> color) {
  const double needed = text_width_px(text, height_px);
  const double fitting = needed > width ? std::max(kSmallestText, height_px * width / needed) : height_px;
  draw_text(sheet, text, x, y + (height_px - fitting) / 2, fitting, color);
}

}  // namespace

Result<Image> make_contact_sheet(const std::vector<ContactSheetEntry>& entries, const ContactSheetOptions& options) {
  const auto layout = lay_out(entries, options);
  if (!layout) return tl::unexpected(layout.error());
  Image sheet =
      Image::filled(static_cast<std::uint32_t>(layout->width), static_cast<std::uint32_t>(layout->height), kPaper);
  const double gap = options.gap_px;
  if (!options.title.empty()) {
    draw_line(sheet, options.title, gap, gap, static_cast<double>(layout->width) - 2 * gap,
              options.text_height_px * 1.4, kInk);
  }
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const std::uint64_t column = i % layout->columns;
    const std::uint64_t row = i / layout->columns;
    const auto x = static_cast<std::uint32_t>(options.gap_px + column * (layout->cell_width + options.gap_px));
    const auto y = static_cast<std::uint32_t>(options.gap_px + layout->title_height +
                                              row * (layout->cell_height + options.gap_px));
    const Image& image = entries[i].image;
    for (std::uint32_t line = 0; line < image.height; ++line) {
      std::copy_n(image.pixel(0, line), 4 * std::size_t{image.width}, sheet.pixel(x, y + line));
    }
    double text_y = y + image.height + gap / 2;
    for (std::size_t line = 0; line < entries[i].caption.size(); ++line) {
      draw_line(sheet, entries[i].caption[line], x, text_y, image.width, options.text_height_px,
                line == 0 ? kInk : kPaleInk);
      text_y += std::ceil(options.text_height_px * kLineSpacing);
    }
  }
  return sheet;
}

}  // namespace fanstream
