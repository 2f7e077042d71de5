#include "client/export/level_store.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/support/atomic_file.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace fanstream {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr std::uint64_t kLargestManifestBytes = 1U << 20U;
constexpr const char* kFormat = "fanstream levels 1";

bool is_plain_name(const std::string& name) {
  return !name.empty() && name != "." && name != ".." &&
         name.find_first_of(std::string_view("/\\\0", 3)) == std::string::npos;
}

Json json_of(const StoredFile& file) {
  return {{"file", file.name}, {"size_bytes", file.size_bytes}, {"hash", file.hash}};
}

// Members by name and type. The first that is missing or of another type is noted; reading goes on with nothing.
class MemberReader {
 public:
  template <class Value>
  Value get(const Json& json, const char* name) {
    const auto found = json.is_object() ? json.find(name) : json.end();
    if (!json.is_object() || found == json.end()) return note(fmt::format("has no {}", name)), Value{};
    if constexpr (std::is_same_v<Value, std::string>) {
      if (found->is_string()) return found->template get<std::string>();
    } else if constexpr (std::is_same_v<Value, bool>) {
      if (found->is_boolean()) return found->template get<bool>();
    } else if constexpr (std::is_same_v<Value, double>) {
      if (found->is_number()) return found->template get<double>();
    } else if (found->is_number_unsigned()) {
      return found->template get<Value>();
    }
    return note(fmt::format("has a malformed {}", name)), Value{};
  }
  void note(std::string fault) {
    if (fault_.empty()) fault_ = std::move(fault);
  }
  const std::string& fault() const { return fault_; }

 private:
  std::string fault_;
};

StoredFile file_of(MemberReader& reader, const Json& json) {
  StoredFile file{reader.get<std::string>(json, "file"), reader.get<std::uint64_t>(json, "size_bytes"),
                  reader.get<std::string>(json, "hash")};
  if (!is_plain_name(file.name)) reader.note("names a file outside its folder");
  return file;
}

LevelManifest manifest_of(MemberReader& reader, const Json& json) {
  LevelManifest manifest;
  if (reader.get<std::string>(json, "format") != kFormat) reader.note("is of another format");
  manifest.source = reader.get<std::string>(json, "source");
  manifest.source_hash = reader.get<std::string>(json, "source_hash");
  manifest.settings = reader.get<std::string>(json, "settings");
  manifest.source_triangles = reader.get<std::uint64_t>(json, "source_triangles");
  manifest.source_vertices = reader.get<std::uint64_t>(json, "source_vertices");
  manifest.has_texture_coordinates = reader.get<bool>(json, "texture_coordinates");
  manifest.has_colors = reader.get<bool>(json, "colors");
  if (!reader.fault().empty()) return manifest;
  const auto levels = json.find("levels");
  if (levels == json.end() || !levels->is_array()) return reader.note("has no levels"), manifest;
  for (const Json& level : *levels) {
    StoredLevel stored;
    stored.asked_triangles = reader.get<std::uint64_t>(level, "asked_triangles");
    stored.triangles = reader.get<std::uint64_t>(level, "triangles");
    stored.vertices = reader.get<std::uint64_t>(level, "vertices");
    stored.relative_rms = reader.get<double>(level, "relative_rms");
    stored.relative_max = reader.get<double>(level, "relative_max");
    stored.shortfall = reader.get<std::string>(level, "shortfall");
    stored.file = file_of(reader, level);
    manifest.levels.push_back(std::move(stored));
  }
  const auto picture = json.find("picture");
  if (picture != json.end() && !picture->is_null()) manifest.picture = file_of(reader, *picture);
  return manifest;
}

// Why a file is not what was stored; empty if it is.
std::string file_obstacle(const fs::path& folder, const StoredFile& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(folder / file.name, error);
  if (error) return file.name + " is missing";
  if (size != file.size_bytes) return file.name + " has changed";
  const Result<std::string> hash = hash_of_file(folder / file.name);
  if (!hash) return file.name + " cannot be read";
  return *hash == file.hash ? std::string() : file.name + " has changed";
}

std::string manifest_obstacle(const fs::path& folder, const LevelManifest& wanted, const LevelManifest& stored,
                              bool with_picture) {
  if (stored.source_hash != wanted.source_hash) return "the source has changed, or was another";
  if (stored.settings != wanted.settings) return "they were made with other options";
  bool same = stored.levels.size() == wanted.levels.size();
  for (std::size_t i = 0; same && i < wanted.levels.size(); ++i) {
    same = stored.levels[i].asked_triangles == wanted.levels[i].asked_triangles;
  }
  if (!same) return "they are of other numbers of triangles";
  if (with_picture && !stored.picture) return "there is no picture of them";
  for (const StoredLevel& level : stored.levels) {
    if (std::string obstacle = file_obstacle(folder, level.file); !obstacle.empty()) return obstacle;
  }
  return with_picture ? file_obstacle(folder, *stored.picture) : std::string();
}

}  // namespace

struct ContentHash::State {
  XXH3_state_t state;
};

ContentHash::ContentHash() : state_(std::make_unique<State>()) { XXH3_128bits_reset(&state_->state); }
ContentHash::~ContentHash() = default;

void ContentHash::add(std::span<const std::byte> bytes) {
  XXH3_128bits_update(&state_->state, bytes.data(), bytes.size());
}

std::string ContentHash::text() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(&state_->state);
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

Result<std::string> hash_of_file(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return fail(ErrorKind::not_found, path.string() + ": no such file");
  if (!fs::is_regular_file(path, error)) return fail(ErrorKind::io, path.string() + ": is not a regular file");
  std::ifstream file(path, std::ios::binary);
  ContentHash hash;
  std::vector<char> block(std::size_t{1} << 18U);
  while (file) {
    file.read(block.data(), static_cast<std::streamsize>(block.size()));
    hash.add(std::as_bytes(std::span(block).first(static_cast<std::size_t>(file.gcount()))));
  }
  if (!file.eof()) return fail(ErrorKind::io, path.string() + ": cannot be read; check its permissions");
  return hash.text();
}

std::string encode_manifest(const LevelManifest& manifest) {
  Json levels = Json::array();
  for (const StoredLevel& level : manifest.levels) {
    Json json{{"asked_triangles", level.asked_triangles},
              {"triangles", level.triangles},
              {"vertices", level.vertices},
              {"relative_rms", level.relative_rms},
              {"relative_max", level.relative_max},
              {"shortfall", level.shortfall}};
    json.update(json_of(level.file));
    levels.push_back(std::move(json));
  }
  const Json json{{"format", kFormat},
                  {"source", manifest.source},
                  {"source_hash", manifest.source_hash},
                  {"settings", manifest.settings},
                  {"source_triangles", manifest.source_triangles},
                  {"source_vertices", manifest.source_vertices},
                  {"texture_coordinates", manifest.has_texture_coordinates},
                  {"colors", manifest.has_colors},
                  {"levels", std::move(levels)},
                  {"picture", manifest.picture ? json_of(*manifest.picture) : Json(nullptr)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<LevelManifest> decode_manifest(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return fail(ErrorKind::bad_input, "the manifest is not JSON");
  MemberReader reader;
  LevelManifest manifest = manifest_of(reader, json);
  if (!reader.fault().empty()) return fail(ErrorKind::bad_input, "the manifest " + reader.fault());
  return manifest;
}

StoredLevels find_levels(const fs::path& folder, const LevelManifest& wanted, bool with_picture) {
  const fs::path path = folder / kManifestName;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return {std::nullopt, "there are none yet"};
  if (size > kLargestManifestBytes) return {std::nullopt, "the manifest is too large to be one"};
  std::string text(static_cast<std::size_t>(size), '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.read(text.data(), static_cast<std::streamsize>(text.size()))) {
    return {std::nullopt, "the manifest cannot be read"};
  }
  Result<LevelManifest> stored = decode_manifest(text);
  if (!stored) return {std::nullopt, stored.error().message};
  std::string obstacle = manifest_obstacle(folder, wanted, *stored, with_picture);
  if (!obstacle.empty()) return {std::nullopt, std::move(obstacle)};
  return {std::move(*stored), {}};
}

Result<StoredFile> store_file(const fs::path& folder, const std::string& name, std::span<const std::uint8_t> bytes) {
  if (auto written = write_file_atomically(folder / name, bytes); !written) return tl::unexpected(written.error());
  ContentHash hash;
  hash.add(std::as_bytes(bytes));
  return StoredFile{name, bytes.size(), hash.text()};
}

Result<void> store_manifest(const fs::path& folder, const LevelManifest& manifest) {
  const std::string text = encode_manifest(manifest);
  return write_file_atomically(folder / kManifestName, std::as_bytes(std::span(text)));
}

}  // namespace fanstream
