// An asset in memory, opened from its bytes: what is measured, replayed and served here.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/asset/asset_layout.h"
#include "common/asset/segment_source.h"
#include "common/refine/progressive_mesh.h"

namespace fanstream::bench {

// Immutable once open; all members may be called from any number of threads at once.
class OpenAsset final : public SegmentSource {
 public:
  // Fails as read_preamble, read_head and read_index do, with errors that start with `name`.
  static Result<std::shared_ptr<const OpenAsset>> open(std::vector<std::byte> bytes, const std::string& name);

  const AssetPreamble& preamble() const { return preamble_; }
  std::shared_ptr<const AssetHead> asset_head() const { return asset_head_; }
  std::shared_ptr<const AssetIndex> asset_index() const { return asset_index_; }

  Digest digest() const override { return preamble_.digest; }
  std::span<const std::byte> head() const override;
  std::span<const std::byte> index() const override;
  std::uint32_t cell_count() const override { return static_cast<std::uint32_t>(asset_index_->cells.size()); }
  std::uint32_t segment_count(std::uint32_t cell) const override { return asset_index_->piece_count(cell); }
  std::span<const std::byte> segment(std::uint32_t cell, std::uint32_t segment) const override;
  std::uint64_t vertex_count() const override { return asset_head_->vertex_count; }
  std::uint64_t triangle_count() const override { return asset_head_->triangle_count; }
  std::uint64_t size_bytes() const override { return bytes_.size(); }

 private:
  OpenAsset() = default;
  std::vector<std::byte> bytes_;
  AssetPreamble preamble_;
  std::shared_ptr<const AssetHead> asset_head_;
  std::shared_ptr<const AssetIndex> asset_index_;
};

// What a client does with a whole asset: reads head and index, takes all segments, refines to the full model. Copies
// no more of `bytes` than a client would.
Result<std::unique_ptr<ProgressiveMesh>> rebuild_fully(std::span<const std::byte> bytes, const std::string& name);

}  // namespace fanstream::bench
