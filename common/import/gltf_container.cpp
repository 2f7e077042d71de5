#include "common/import/gltf_container.h"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/import/text_scanner.h"

namespace fanstream {
namespace {

using nlohmann::json;

constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;
constexpr int kMaxJsonDepth = 16;  // the deepest value we use lies at depth 9
constexpr std::size_t kMaxBuffers = 65536;

std::uint32_t read_u32(std::string_view bytes, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

// Files of version 1 are the ones that list everything by name.
bool is_version_one(const json& document) {
  const auto asset = document.find("asset");
  if (asset == document.end() || !asset->is_object()) return false;
  const auto version = asset->find("version");
  if (version == asset->end()) return false;
  if (version->is_string()) return version->get_ref<const std::string&>().starts_with("1.");
  return version->is_number() && version->get<double>() < 2.0;
}

Result<std::string_view> read_chunk(const InputFile& file, std::size_t length, std::size_t& offset,
                                    std::uint32_t& type) {
  if (length - offset < 8)
    return fail_at_byte(file, offset, "the file ends within a GLB chunk header: it is truncated");
  const std::uint32_t size = read_u32(file.bytes(), offset);
  type = read_u32(file.bytes(), offset + 4);
  if (size > length - offset - 8) {
    return fail_at_byte(file, offset,
                        fmt::format("the GLB chunk claims {} bytes, but only {} follow: the file is truncated "
                                    "or damaged",
                                    size, length - offset - 8));
  }
  const std::string_view chunk = file.bytes().substr(offset + 8, size);
  offset += 8 + size;
  return chunk;
}

std::optional<std::string> decode_base64(std::string_view text) {
  std::array<std::int8_t, 256> value_of{};
  value_of.fill(-1);
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < kDigits.size(); ++i) {
    value_of[static_cast<unsigned char>(kDigits[i])] = static_cast<std::int8_t>(i);
  }
  while (text.ends_with('=')) text.remove_suffix(1);
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int bit_count = 0;
  for (const char c : text) {
    const int value = value_of[static_cast<unsigned char>(c)];
    if (value < 0) return std::nullopt;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    bit_count += 6;
    if (bit_count < 8) continue;
    bit_count -= 8;
    bytes.push_back(static_cast<char>(bits >> bit_count & 0xFF));
  }
  return bytes;
}

std::optional<std::string> decode_percent(std::string_view uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] != '%') {
      text.push_back(uri[i]);
      continue;
    }
    const auto digit = [&](std::size_t at) {
      const char c = at < uri.size() ? uri[at] : 'x';
      if (c >= '0' && c <= '9') return c - '0';
      if (c >= 'a' && c <= 'f') return c - 'a' + 10;
      return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
    };
    if (digit(i + 1) < 0 || digit(i + 2) < 0) return std::nullopt;
    text.push_back(static_cast<char>(16 * digit(i + 1) + digit(i + 2)));
    i += 2;
  }
  return text;
}

Result<std::filesystem::path> resolve(const InputFile& file, const std::string& uri, std::string_view what) {
  const std::optional<std::string> decoded = decode_percent(uri);
  const auto refuse = [&](std::string_view why) {
    return fail_in(file, ErrorKind::bad_input, fmt::format("{}: the uri {} {}", what, quote(uri), why));
  };
  if (!decoded || decoded->empty() || decoded->find('\0') != std::string::npos) return refuse("is malformed");
  if (decoded->find(':') != std::string::npos || decoded->find('\\') != std::string::npos) {
    return refuse("is not a relative path: only files beside the model are read");
  }
  std::error_code fault;
  const std::filesystem::path folder = std::filesystem::canonical(
      file.path().has_parent_path() ? file.path().parent_path() : std::filesystem::path("."), fault);
  if (fault) return refuse("cannot be resolved: " + fault.message());
  // Canonical, so that neither ".." nor a symbolic link leads out of the folder.
  const std::filesystem::path path = std::filesystem::weakly_canonical(folder / *decoded, fault);
  if (fault) return refuse("cannot be resolved: " + fault.message());
  const auto [folder_end, unused] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  if (folder_end != folder.end()) return refuse("leads out of the model's folder, which is not allowed");
  return path;
}

Result<GltfBuffer> load_data_uri(const InputFile& file, std::string_view uri, std::string_view what) {
  const std::size_t comma = uri.find(',');
  if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64")) {
    return fail_in(file, ErrorKind::bad_input, fmt::format("{}: the data uri is not in base64", what));
  }
  const std::optional<std::string> bytes = decode_base64(uri.substr(comma + 1));
  if (!bytes) return fail_in(file, ErrorKind::bad_input, fmt::format("{}: the data uri is malformed base64", what));
  return GltfBuffer{{}, {bytes->begin(), bytes->end()}};
}

Result<GltfBuffer> load_external(const InputFile& file, const std::string& uri, std::string_view what) {
  const Result<std::filesystem::path> path = resolve(file, uri, what);
  if (!path) return tl::unexpected(path.error());
  const Result<InputFile> external = InputFile::read(*path);
  if (!external) {
    const std::string_view reason = external.error().message;  // "path: reason"
    return fail_in(file, external.error().kind,
                   fmt::format("{}: its file {} {}", what, quote(uri), reason.substr(reason.rfind(": ") + 2)));
  }
  const std::string_view bytes = external->bytes();
  return GltfBuffer{{}, {bytes.begin(), bytes.end()}};
}

}  // namespace

Result<GltfParts> split_gltf(const InputFile& file) {
  const std::string_view bytes = file.bytes();
  if (!bytes.starts_with("glTF")) return GltfParts{bytes, {}};
  if (bytes.size() < 12)
    return fail_at_byte(file, bytes.size(), "the file ends within the GLB header: it is truncated");
  if (read_u32(bytes, 4) != 2) {
    return fail_in(file, ErrorKind::unsupported,
                   fmt::format("GLB version {}: only version 2 can be read", read_u32(bytes, 4)));
  }
  const std::size_t length = read_u32(bytes, 8);
  if (length > bytes.size()) {
    return fail_at_byte(
        file, 8,
        fmt::format("the GLB header claims {} bytes, but the file has {}: it is truncated", length, bytes.size()));
  }
  if (length < 12) return fail_at_byte(file, 8, "the GLB header claims less than its own length");
  GltfParts parts;
  std::size_t offset = 12;
  bool first = true;
  while (offset < length) {
    std::uint32_t type = 0;
    const std::size_t begin = offset;
    const Result<std::string_view> chunk = read_chunk(file, length, offset, type);
    if (!chunk) return tl::unexpected(chunk.error());
    if (first != (type == kJsonChunk))
      return fail_at_byte(file, begin + 4, "the first GLB chunk, and only it, must be JSON");
    if (first) parts.json = *chunk;
    if (type == kBinaryChunk && parts.binary.empty()) parts.binary = *chunk;
    first = false;
  }
  if (first) return fail_at_byte(file, 12, "the GLB file has no JSON chunk: it is truncated");
  return parts;
}

Result<json> parse_gltf_json(const InputFile& file, std::string_view text) {
  constexpr std::array<std::string_view, 10> kIgnored = {"extras",  "images", "textures",   "samplers", "materials",
                                                         "cameras", "skins",  "animations", "targets",  "name"};
  const auto keep = [&](int depth, json::parse_event_t event, json& parsed) {
    if (depth > kMaxJsonDepth) return false;
    if (event != json::parse_event_t::key) return true;
    const auto& key = parsed.get_ref<const std::string&>();
    return std::find(kIgnored.begin(), kIgnored.end(), key) == kIgnored.end();
  };
  try {
    json document = json::parse(text.begin(), text.end(), keep);
    if (!document.is_object()) return fail_in(file, ErrorKind::bad_input, "the glTF JSON is not an object");
    if (is_version_one(document)) {
      return fail_in(file, ErrorKind::unsupported, "glTF version 1: only version 2 can be read; convert it");
    }
    return document;
  } catch (const json::parse_error& problem) {
    const std::size_t offset = static_cast<std::size_t>(text.data() - file.bytes().data()) + problem.byte;
    const std::string_view reason = problem.what();  // "[json.exception.parse_error.101] parse error at ...: reason"
    return fail_at_byte(file, offset, fmt::format("malformed JSON: {}", reason.substr(reason.find("] ") + 2)));
  }
}

Result<std::vector<GltfBuffer>> load_gltf_buffers(const InputFile& file, const json& document,
                                                  std::string_view binary) {
  std::vector<GltfBuffer> buffers;
  const auto list = document.find("buffers");
  if (list == document.end()) return buffers;
  if (!list->is_array() || list->size() > kMaxBuffers) {
    return fail_in(file, ErrorKind::bad_input, "'buffers' is not a list of at most 65536 buffers");
  }
  for (const json& entry : *list) {
    const std::string what = fmt::format("buffer {}", buffers.size());
    const auto length = entry.is_object() ? entry.find("byteLength") : entry.end();
    if (!entry.is_object() || length == entry.end() || !length->is_number_unsigned()) {
      return fail_in(file, ErrorKind::bad_input, what + " has no byteLength");
    }
    const auto uri = entry.find("uri");
    Result<GltfBuffer> buffer = GltfBuffer{binary, {}};
    if (uri != entry.end()) {
      if (!uri->is_string()) return fail_in(file, ErrorKind::bad_input, what + ": its uri is not a string");
      const auto& text = uri->get_ref<const std::string&>();
      buffer = text.starts_with("data:") ? load_data_uri(file, text, what) : load_external(file, text, what);
    }
    if (!buffer) return tl::unexpected(buffer.error());
    const auto claimed = length->get<std::uint64_t>();
    if (claimed > buffer->view().size()) {
      return fail_in(file, ErrorKind::bad_input,
                     fmt::format("{} claims {} bytes, but holds {}: a file is truncated or missing", what, claimed,
                                 buffer->view().size()));
    }
    buffers.push_back(std::move(*buffer));
  }
  return buffers;
}

}  // namespace fanstream
