// Assets of test meshes, and a server over them.
#pragma once

#include <memory>
#include <string>

#include "common/asset/asset_file.h"
#include "common/mesh/triangle_mesh.h"
#include "server/build/asset_builder.h"
#include "server/net/stream_server.h"
#include "tests/support/synthetic_source.h"

namespace fanstream::testing {

// The asset of a clean mesh. Throws what the builder says where it fails.
std::shared_ptr<const AssetFile> build_model(const TriangleMesh& mesh, const BuildOptions& options = {});
// The Stanford bunny, imported, cleaned and built once; null where ../shared/data is absent.
struct BuiltBunny {
  TriangleMesh mesh;  // cleaned
  std::shared_ptr<const AssetFile> asset;
};
const BuiltBunny* built_bunny();

// mesh_hash of the mesh with every position moved to the asset's grid: what complete refinement must give.
std::string quantised_hash(const TriangleMesh& mesh, const AssetFile& asset);

// Serves on a free port of 127.0.0.1 as long as it lives.
class ModelServer {
 public:
  ModelServer();
  void add(const std::string& name, std::shared_ptr<const SegmentSource> source) {
    models->set_ready(name, std::move(source));
  }
  std::uint16_t port() const { return server->port(); }
  std::string address() const { return "127.0.0.1:" + std::to_string(port()); }

  std::shared_ptr<SyntheticProvider> models = std::make_shared<SyntheticProvider>();
  std::unique_ptr<StreamServer> server;
};

}  // namespace fanstream::testing
