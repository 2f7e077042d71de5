// Lines of text in pictures: DejaVu Sans, built into the library, so that no font need be installed where it runs.
#pragma once

#include <array>
#include <string_view>

#include "client/render/image.h"

namespace fanstream {

// Width in pixels of one line of UTF-8 (malformed bytes and characters the font lacks become its box). `height_px` is
// the distance from the top of the tallest letters to the bottom of the deepest, 6 to 200.
double text_width_px(std::string_view text, double height_px);

// Draws one line with its top left corner at (x, y), clipped to the image.
void draw_text(Image& image, std::string_view text, double x, double y, double height_px,
               std::array<std::uint8_t, 3> color);

}  // namespace fanstream
