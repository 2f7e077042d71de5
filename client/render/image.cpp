#include "client/render/image.h"

#include <fmt/format.h>
#include <png.h>

#include "common/support/atomic_file.h"

namespace fanstream {

Image Image::filled(std::uint32_t width, std::uint32_t height, std::array<std::uint8_t, 4> color) {
  Image image{width, height, {}};
  image.rgba.resize(4 * std::size_t{width} * height);
  for (std::size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = color[i % 4];
  return image;
}

Result<std::vector<std::uint8_t>> encode_png(const Image& image) {
  const std::size_t size_bytes = 4 * std::size_t{image.width} * image.height;
  if (size_bytes == 0 || image.rgba.size() != size_bytes) {
    return fail(ErrorKind::usage, fmt::format("PNG: {} bytes are not an image of {}x{} pixels", image.rgba.size(),
                                              image.width, image.height));
  }
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = image.width;
  png.height = image.height;
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> encoded(PNG_IMAGE_PNG_SIZE_MAX(png));
  png_alloc_size_t encoded_bytes = encoded.size();
  if (png_image_write_to_memory(&png, encoded.data(), &encoded_bytes, 0, image.rgba.data(), 0, nullptr) == 0) {
    const std::string message = fmt::format("PNG: {}", png.message);
    png_image_free(&png);
    return fail(ErrorKind::io, message);
  }
  encoded.resize(encoded_bytes);
  return encoded;
}

Result<void> write_png(const Image& image, const std::filesystem::path& path) {
  const auto encoded = encode_png(image);
  if (!encoded) return tl::unexpected(with_context(encoded.error(), path.string()));
  return write_file_atomically(path, *encoded);
}

}  // namespace fanstream
