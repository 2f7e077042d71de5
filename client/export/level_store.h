// Levels of detail in a folder: mesh files and a manifest that tells whether they can be used again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/support/result.h"

namespace fanstream {

// 32 hexadecimal digits of XXH3-128 over everything that was added: finds change and damage, not forgery.
class ContentHash {
 public:
  ContentHash();
  ~ContentHash();
  ContentHash(const ContentHash&) = delete;
  ContentHash& operator=(const ContentHash&) = delete;
  void add(std::span<const std::byte> bytes);
  std::string text() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};
// Of a whole file. Errors (not_found, io) begin with the path.
Result<std::string> hash_of_file(const std::filesystem::path& path);

struct StoredFile {
  std::string name;  // within the folder
  std::uint64_t size_bytes = 0;
  std::string hash;
};

struct StoredLevel {
  std::uint64_t asked_triangles = 0;
  std::uint64_t triangles = 0, vertices = 0;      // of the reduced mesh, positions counted once
  double relative_rms = 0.0, relative_max = 0.0;  // distance from the source, by its diagonal
  std::string shortfall;                          // why there are more than were asked for; empty where there are not
  StoredFile file;
};

struct LevelManifest {
  std::string source;       // as it was named, for people
  std::string source_hash;  // of what it held
  std::string settings;     // everything else that decides what the files are
  std::uint64_t source_triangles = 0, source_vertices = 0;
  bool has_texture_coordinates = false, has_colors = false;
  std::vector<StoredLevel> levels;  // by falling asked_triangles
  std::optional<StoredFile> picture;
};

inline constexpr std::string_view kManifestName = "levels.json";

// JSON, and back. Decoding fails (bad_input) naming what is missing or wrong; file names are plain ones.
std::string encode_manifest(const LevelManifest& manifest);
Result<LevelManifest> decode_manifest(std::string_view text);

// What a folder holds, if that is what the wanted manifest (of which levels need only asked_triangles) would make: the
// same source, settings and counts, a picture if one is wanted, and every file there with its size and hash.
struct StoredLevels {
  std::optional<LevelManifest> manifest;
  std::string obstacle;  // else: why the levels have to be made, in a few words
};
StoredLevels find_levels(const std::filesystem::path& folder, const LevelManifest& wanted, bool with_picture);

// Writes one file into the folder as write_file_atomically and says how it will be recognised.
Result<StoredFile> store_file(const std::filesystem::path& folder, const std::string& name,
                              std::span<const std::uint8_t> bytes);
// To be called last: only then can the files be used again. Whatever stops before leaves the former manifest, whose
// hashes do not fit files that have been replaced since.
Result<void> store_manifest(const std::filesystem::path& folder, const LevelManifest& manifest);

}  // namespace fanstream
