#include "server/store/source_key.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

namespace fanstream {
namespace {

// Raise it when import, clean-up or the builder make something else of the same file.
constexpr std::uint32_t kBuilderRevision = 8;

class Hasher {
 public:
  Hasher() : state_(XXH3_createState(), &XXH3_freeState) { XXH3_128bits_reset(state_.get()); }
  void add(const void* data, std::size_t size) { XXH3_128bits_update(state_.get(), data, size); }
  void add(std::string_view text) {  // with its length, so that neighbours cannot run into each other
    add_number(text.size());
    add(text.data(), text.size());
  }
  void add_number(double value) { add(&value, sizeof value); }
  std::string text() const {
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(state_.get()));
    std::string text;
    for (const unsigned char byte : canonical.digest) text += fmt::format("{:02x}", byte);
    return text;
  }

 private:
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_;
};

// `keep`, if there is one, also gets the bytes.
Result<void> add_file(const std::filesystem::path& path, Hasher& hasher, std::string* keep) {
  const std::unique_ptr<std::FILE, decltype(&std::fclose)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  const auto failure = [&] {
    const int error = errno;
    return fail(error == ENOENT ? ErrorKind::not_found : ErrorKind::io,
                path.string() + ": cannot be read: " + std::error_code(error, std::generic_category()).message());
  };
  if (!file) return failure();
  std::vector<char> buffer(1U << 20U);
  double total = 0;
  while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), file.get())) {
    hasher.add(buffer.data(), size);
    if (keep != nullptr) keep->append(buffer.data(), size);
    total += static_cast<double>(size);
  }
  if (std::ferror(file.get()) != 0) return failure();
  hasher.add_number(total);
  return {};
}

void add_buffers(const std::filesystem::path& path, const std::string& gltf, Hasher& hasher) {
  const nlohmann::json document = nlohmann::json::parse(gltf, nullptr, false);
  if (!document.is_object() || !document.contains("buffers") || !document["buffers"].is_array()) return;
  for (const nlohmann::json& buffer : document["buffers"]) {
    if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) continue;
    const std::string uri = buffer["uri"];
    // Import reads nothing outside the file's own folder either.
    if (uri.starts_with("data:") || uri.starts_with("/") || uri.find("..") != std::string::npos) continue;
    hasher.add(uri);
    const Result<void> added = add_file(path.parent_path() / uri, hasher, nullptr);
    hasher.add_number(added ? 1 : 0);
  }
}

void add_options(const BuildOptions& options, Hasher& hasher) {
  hasher.add_number(kBuilderRevision);
  hasher.add_number(kAssetVersion);
  hasher.add_number(options.position_bits.value_or(0));
  hasher.add_number(options.base_vertices.value_or(0));
  hasher.add_number(options.cell_vertices.value_or(0.0));
  hasher.add_number(options.slab_growth.value_or(0.0));
  hasher.add_number(options.segment_splits.value_or(0.0));
  hasher.add_number(options.edges_per_vertex.value_or(0.0));
  hasher.add_number(options.evenness.value_or(-1.0));
  hasher.add_number(options.distance_growth.value_or(-1.0));
  const CostOptions& cost = options.cost;
  hasher.add_number(static_cast<double>(cost.cost));
  hasher.add_number(static_cast<double>(cost.placement));
  hasher.add_number(cost.quadrics ? static_cast<double>(*cost.quadrics) : -1.0);
  hasher.add_number(static_cast<double>(valences_of(cost)));
  hasher.add_number(cost.curvature ? static_cast<double>(*cost.curvature) : -1.0);
  hasher.add_number(cost.kappa.value_or(-1.0));
  hasher.add_number(cost.samples.value_or(0));
  hasher.add_number(static_cast<double>(cost.seed));
}

}  // namespace

Result<std::string> source_key(const std::filesystem::path& path, const BuildOptions& options) {
  Hasher hasher;
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  hasher.add(extension);  // import looks at it where the content does not tell the format
  std::string content;
  const bool gltf = extension == ".gltf";
  if (Result<void> added = add_file(path, hasher, gltf ? &content : nullptr); !added)
    return tl::unexpected(added.error());
  if (gltf) add_buffers(path, content, hasher);
  add_options(options, hasher);
  return hasher.text();
}

}  // namespace fanstream
