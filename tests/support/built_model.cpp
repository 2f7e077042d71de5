#include "tests/support/built_model.h"

#include <stdexcept>

#include "common/mesh/mesh_hash.h"
#include "server/build/asset_builder.h"
#include "tests/support/cleaned_shared_mesh.h"

namespace fanstream::testing {

std::shared_ptr<const AssetFile> build_model(const TriangleMesh& mesh, const BuildOptions& options) {
  Result<BuiltAsset> built = build_asset(mesh, options);
  if (!built) throw std::runtime_error(built.error().message);
  auto asset = AssetFile::from_memory(std::move(built->bytes), "test asset");
  if (!asset) throw std::runtime_error(asset.error().message);
  return *asset;
}

const BuiltBunny* built_bunny() {
  static const std::unique_ptr<const BuiltBunny> bunny = []() -> std::unique_ptr<const BuiltBunny> {
    std::optional<TriangleMesh> mesh = cleaned_shared_mesh("stanford_bunny_zipper.ply");
    if (!mesh) return nullptr;
    auto asset = build_model(*mesh);
    return std::make_unique<const BuiltBunny>(BuiltBunny{std::move(*mesh), std::move(asset)});
  }();
  return bunny.get();
}

std::string quantised_hash(const TriangleMesh& mesh, const AssetFile& asset) {
  const PositionGrid& grid = asset.asset_head()->grid;
  TriangleMesh quantised = mesh;
  for (glm::dvec3& position : quantised.positions) position = grid.decode(grid.encode(position));
  return mesh_hash(quantised);
}

ModelServer::ModelServer() {
  ServerOptions options;
  options.host = "127.0.0.1";
  options.port = 0;
  options.building_poll_ms = 10;
  auto started = StreamServer::start(options, models);
  if (!started) throw std::runtime_error(started.error().message);
  server = std::move(*started);
}

}  // namespace fanstream::testing
