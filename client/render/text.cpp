#include "client/render/text.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <vector>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wshadow"
#define STBTT_STATIC
#define STB_TRUETYPE_IMPLEMENTATION
#include <stb/stb_truetype.h>
#pragma GCC diagnostic pop

// The font file as the linker sees it; FANSTREAM_FONT_FILE is found by CMake (Debian: fonts-dejavu-core).
__asm__(
    ".section .rodata\n"
    ".balign 16\n"
    "fanstream_font_begin: .incbin \"" FANSTREAM_FONT_FILE
    "\"\n"
    ".byte 0\n"
    ".previous\n");
extern "C" const unsigned char fanstream_font_begin[];

namespace fanstream {
namespace {

const stbtt_fontinfo& font() {
  static const stbtt_fontinfo info = [] {
    stbtt_fontinfo loaded;
    [[maybe_unused]] const int ok = stbtt_InitFont(&loaded, fanstream_font_begin, 0);
    assert(ok != 0);
    return loaded;
  }();
  return info;
}

// The next code point; U+FFFD for bytes that are no UTF-8, one at a time.
int next_code_point(std::string_view& text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  const std::size_t length = first < 0x80 ? 1 : first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  unsigned code = length == 1 ? first : first & (0x7FU >> length);
  bool valid = length == 1 || (first >= 0xC2 && first <= 0xF4 && text.size() >= length);
  for (std::size_t i = 1; valid && i < length; ++i) {
    valid = (byte(i) & 0xC0U) == 0x80U;
    code = code << 6U | (byte(i) & 0x3FU);
  }
  text.remove_prefix(valid ? length : 1);
  return valid ? static_cast<int>(code) : 0xFFFD;
}

// Calls visit(glyph, pen position) for every character, the pen in pixels from the line's start; returns where it ends.
template <class Visit>
double lay_out(std::string_view text, double scale, Visit&& visit) {
  double pen = 0.0;
  int previous = 0;
  while (!text.empty()) {
    const int glyph = stbtt_FindGlyphIndex(&font(), next_code_point(text));
    if (previous != 0) pen += scale * stbtt_GetGlyphKernAdvance(&font(), previous, glyph);
    visit(glyph, pen);
    int advance = 0;
    int bearing = 0;
    stbtt_GetGlyphHMetrics(&font(), glyph, &advance, &bearing);
    pen += scale * advance;
    previous = glyph;
  }
  return pen;
}

float scale_for(double height_px) {
  return stbtt_ScaleForPixelHeight(&font(), static_cast<float>(std::clamp(height_px, 6.0, 200.0)));
}

void blend_glyph(Image& image, int glyph, double x, int baseline, float scale, std::array<std::uint8_t, 3> color) {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;
  const double whole = std::floor(x);
  const auto shift = static_cast<float>(x - whole);
  stbtt_GetGlyphBitmapBoxSubpixel(&font(), glyph, scale, scale, shift, 0, &left, &top, &right, &bottom);
  if (right <= left || bottom <= top) return;
  const int width = right - left;
  std::vector<unsigned char> coverage(static_cast<std::size_t>(width) * static_cast<std::size_t>(bottom - top));
  stbtt_MakeGlyphBitmapSubpixel(&font(), coverage.data(), width, bottom - top, width, scale, scale, shift, 0, glyph);
  for (int row = top; row < bottom; ++row) {
    for (int column = left; column < right; ++column) {
      const double px = whole + column;
      const int py = baseline + row;
      if (px < 0 || py < 0 || px >= image.width || py >= static_cast<int>(image.height)) continue;
      const int alpha = coverage[static_cast<std::size_t>((row - top) * width + column - left)];
      std::uint8_t* pixel = image.pixel(static_cast<std::uint32_t>(px), static_cast<std::uint32_t>(py));
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const int old = pixel[channel];
        pixel[channel] = static_cast<std::uint8_t>(old + (color[channel] - old) * alpha / 255);
      }
    }
  }
}

}  // namespace

double text_width_px(std::string_view text, double height_px) {
  return lay_out(text, scale_for(height_px), [](int, double) {});
}

void draw_text(Image& image, std::string_view text, double x, double y, double height_px,
               std::array<std::uint8_t, 3> color) {
  const float scale = scale_for(height_px);
  int ascent = 0;
  int descent = 0;
  int gap = 0;
  stbtt_GetFontVMetrics(&font(), &ascent, &descent, &gap);
  const int baseline = static_cast<int>(std::lround(y + scale * static_cast<float>(ascent)));
  lay_out(text, scale, [&](int glyph, double pen) { blend_glyph(image, glyph, x + pen, baseline, scale, color); });
}

}  // namespace fanstream
