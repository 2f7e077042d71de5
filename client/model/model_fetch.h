// Receives a model and rebuilds it meanwhile, up to a level.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/model/model_source.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream {

// How much of a model is wanted; without either, all of it. FM0 always comes.
struct FetchGoal {
  // Layers are received, coarse to fine, until they hold so many vertices, and applied generation by generation up to
  // the goal or one cell's share of a generation more; the same goal always gives the same mesh, over any network.
  std::optional<std::uint64_t> vertices;
  // As many segments as fit into so many received bytes, head and index and what the protocol adds included.
  std::optional<std::uint64_t> bytes;
};

struct FetchProgress {
  std::uint64_t vertices = 0;
  std::uint64_t goal_vertices = 0;  // of the whole model, or as wanted
  std::uint64_t bytes = 0;
  std::uint64_t goal_bytes = 0;  // of the whole model, or as wanted
};

struct FetchOptions {
  SourceOptions source;
  std::function<void(const FetchProgress&)> on_progress = {};
};

struct FetchReport {
  std::string source;
  std::string model;
  std::string digest;
  struct {
    std::uint64_t received = 0;  // over the network with all that the protocol adds, or read of the file
    std::uint64_t head = 0, index = 0, segments = 0;  // of the asset, as far as they are in the mesh
  } bytes;
  std::uint64_t segments = 0, segments_total = 0;  // the total is known with the index
  std::uint64_t vertices = 0, triangles = 0;       // of the mesh as it is
  std::uint64_t full_vertices = 0, full_triangles = 0;
  bool complete = false;  // the whole model, and its digest was right
  struct {
    double connect = 0, head = 0, first_mesh = 0, complete = 0;  // since the beginning; complete: the last goal reached
  } seconds;
};

// Not thread safe.
class ModelFetch {
 public:
  // Opens the source and gets FM0: mesh() can be drawn. Errors as ModelSource.
  static Result<std::unique_ptr<ModelFetch>> open(const std::string& source, const FetchOptions& options);
  ModelFetch(const ModelFetch&) = delete;
  ModelFetch& operator=(const ModelFetch&) = delete;

  // Goes on to the goal; goals already passed change nothing. After an error (server gone, damage, stopped) the mesh is
  // what could be made of what came, and the error says how much that is; it cannot be gone on then.
  Result<void> advance(const FetchGoal& goal);

  const ProgressiveMesh& mesh() const { return *mesh_; }
  FetchReport report() const;

 private:
  explicit ModelFetch(FetchOptions options);
  Result<void> receive_base(const std::string& source);
  Result<void> receive_index();
  Result<void> advance_to_vertices(std::uint64_t vertices);
  Result<void> advance_to_position(std::size_t end, const FetchGoal& goal);
  Result<void> advance_to_end(const FetchGoal& goal);
  Result<void> take(std::size_t end, const FetchGoal& goal);
  Result<void> take_piece(const OrderedSegment& piece, std::span<const std::byte> bytes);
  Result<void> finish(const FetchGoal& goal);
  std::size_t end_for_bytes(std::uint64_t bytes) const;
  double elapsed_s() const;
  void tell(const FetchGoal& goal) const;
  Error described(const Error& error) const;

  FetchOptions options_;
  std::unique_ptr<ModelSource> source_;
  AssetPreamble preamble_;
  std::unique_ptr<ProgressiveMesh> mesh_;
  std::shared_ptr<AssetIndex> index_;  // the mesh's
  std::vector<OrderedSegment> order_;
  std::size_t wanted_ = 0;  // of order_
  std::size_t taken_ = 0;
  bool failed_ = false;
  bool verified_ = false;
  struct ContentHash;
  std::shared_ptr<ContentHash> hash_;
  std::int64_t started_us_ = 0;
  FetchReport report_;
};

}  // namespace fanstream
