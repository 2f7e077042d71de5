#include "client/commands/reduce_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>

#include "client/commands/model_options.h"
#include "client/export/level_store.h"
#include "client/model/source_place.h"
#include "common/import/attribute_transfer.h"
#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "common/support/progress_bar.h"

namespace fanstream {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kAssetMagic = "FSAN";

bool has_extension(const fs::path& path, std::string_view extension) {
  std::string own = path.extension().string();
  std::transform(own.begin(), own.end(), own.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return own == extension;
}

bool is_asset(const fs::path& path) {
  std::string start(kAssetMagic.size(), '\0');
  std::ifstream file(path, std::ios::binary);
  return (file.read(start.data(), static_cast<std::streamsize>(start.size())) && start == kAssetMagic) ||
         has_extension(path, ".fan");
}

std::string file_name_of(const std::string& name) {
  std::string safe = name.substr(0, 100);
  for (char& c : safe) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) == 0 && c != '.' && c != '-' && c != '_') c = '_';
  }
  if (safe.empty() || safe.front() == '.') safe.insert(0, "model");
  return safe;
}

template <class Value>
void add_list(ContentHash& hash, const std::vector<Value>& list) {
  const std::uint64_t count = list.size();
  hash.add(std::as_bytes(std::span(&count, 1)));
  hash.add(std::as_bytes(std::span(list)));
}

std::string hash_of_mesh(const ReduceMesh& read) {
  ContentHash hash;
  add_list(hash, read.mesh.positions);
  add_list(hash, read.mesh.triangles);
  add_list(hash, read.attributes.wedges);
  add_list(hash, read.attributes.values.texture_coordinates);
  add_list(hash, read.attributes.values.colors);
  return hash.text();
}

Result<ReduceMesh> read_mesh(const fs::path& path) {
  ImportOptions options;
  options.keep_attributes = true;
  Result<ImportedMesh> imported = import_mesh(path, options);
  if (!imported) return tl::unexpected(imported.error());
  if (const auto going = go_on(); !going) return tl::unexpected(going.error());
  ReduceMesh read;
  read.notes = std::move(imported->warnings);
  CleanedMesh cleaned = clean_mesh(imported->mesh);
  if (cleaned.mesh.triangles.empty()) {
    return fail(ErrorKind::bad_input, path.string() + ": no triangles are left after cleaning: all are degenerate");
  }
  read.attributes = attributes_after_cleaning(imported->mesh, std::move(imported->attributes), cleaned.mesh);
  read.mesh = std::move(cleaned.mesh);
  const RepairReport& report = cleaned.report;
  if (report.degenerate_triangles + report.duplicate_triangles + report.flipped_triangles > 0) {
    read.notes.push_back(fmt::format("{} degenerate and {} duplicate triangles were left out, {} turned over.",
                                     report.degenerate_triangles, report.duplicate_triangles,
                                     report.flipped_triangles));
  }
  if (report.split_edges > 0) {
    read.notes.push_back(fmt::format(
        "{} edges of more than two triangles were opened: they are boundaries now and may part when reduced.",
        report.split_edges));
  }
  return read;
}

}  // namespace

Result<ReduceSource> ReduceSource::open(const std::string& source, ProgressBar& bar) {
  const Result<SourcePlace> place = locate_source(source);
  if (!place) return tl::unexpected(place.error());
  ReduceSource result;
  result.source_ = source;
  if (place->server || is_asset(place->file)) {
    Result<std::unique_ptr<ModelFetch>> fetch = open_model(source, bar);
    if (!fetch) return tl::unexpected(fetch.error());
    result.fetch_ = std::move(*fetch);
    const FetchReport report = result.fetch_->report();
    result.hash_ = "asset " + report.digest;
    result.name_ = file_name_of(fs::path(report.model).stem().string());
    return result;
  }
  result.file_ = place->file;
  result.name_ = file_name_of(place->file.stem().string());
  if (has_extension(result.file_, ".gltf")) {
    Result<ReduceMesh> read = read_mesh(result.file_);
    if (!read) return tl::unexpected(read.error());
    result.hash_ = "mesh " + hash_of_mesh(*read);
    result.read_ = std::make_unique<ReduceMesh>(std::move(*read));
    return result;
  }
  Result<std::string> hash = hash_of_file(result.file_);
  if (!hash) return tl::unexpected(hash.error());
  result.hash_ = "file " + *hash;
  return result;
}

Result<ReduceMesh> ReduceSource::load(ProgressBar& bar) {
  if (fetch_) {
    if (auto advanced = fetch_->advance({}); !advanced) return tl::unexpected(advanced.error());
    return ReduceMesh{fetch_->mesh().triangle_mesh(), {}, {}};
  }
  bar.update("reading", 0.0);
  if (read_) return std::move(*read_);
  return read_mesh(file_);
}

}  // namespace fanstream
