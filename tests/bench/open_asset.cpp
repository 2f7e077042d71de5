#include "tests/bench/open_asset.h"

namespace fanstream::bench {

namespace {

struct Parts {
  AssetPreamble preamble;
  std::shared_ptr<const AssetHead> head;
  std::shared_ptr<const AssetIndex> index;
};

Result<Parts> read_parts(std::span<const std::byte> bytes, const std::string& name) {
  Result<AssetPreamble> preamble = read_preamble(bytes.first(std::min(bytes.size(), kPreambleBytes)), name);
  if (!preamble) return tl::unexpected(preamble.error());
  if (bytes.size() != preamble->file_bytes()) {
    return fail(ErrorKind::bad_input, name + ": " + std::to_string(bytes.size()) + " bytes, its preamble says " +
                                          std::to_string(preamble->file_bytes()));
  }
  Result<AssetHead> head = read_head(bytes.first(preamble->head_bytes), name);
  if (!head) return tl::unexpected(head.error());
  Result<AssetIndex> index = read_whole_index(bytes, *preamble, *head, name);
  if (!index) return tl::unexpected(index.error());
  return Parts{*preamble, std::make_shared<const AssetHead>(std::move(*head)),
               std::make_shared<const AssetIndex>(std::move(*index))};
}

}  // namespace

Result<std::shared_ptr<const OpenAsset>> OpenAsset::open(std::vector<std::byte> bytes, const std::string& name) {
  Result<Parts> parts = read_parts(bytes, name);
  if (!parts) return tl::unexpected(parts.error());
  std::shared_ptr<OpenAsset> asset(new OpenAsset);
  asset->bytes_ = std::move(bytes);
  asset->preamble_ = parts->preamble;
  asset->asset_head_ = std::move(parts->head);
  asset->asset_index_ = std::move(parts->index);
  return asset;
}

std::span<const std::byte> OpenAsset::head() const { return std::span(bytes_).first(preamble_.head_bytes); }

std::span<const std::byte> OpenAsset::index() const {
  return std::span(bytes_).subspan(preamble_.head_bytes, preamble_.index_bytes);
}

std::span<const std::byte> OpenAsset::segment(std::uint32_t cell, std::uint32_t segment) const {
  return std::span(bytes_).subspan(asset_index_->piece_offset(cell, segment), asset_index_->piece_bytes(cell, segment));
}

Result<std::unique_ptr<ProgressiveMesh>> rebuild_fully(std::span<const std::byte> bytes, const std::string& name) {
  Result<Parts> parts = read_parts(bytes, name);
  if (!parts) return tl::unexpected(parts.error());
  auto mesh = std::make_unique<ProgressiveMesh>(parts->head);
  mesh->set_index(parts->index);
  for (std::uint32_t c = 0; c < parts->index->cells.size(); ++c) {
    const CellEntry& cell = parts->index->cells[c];
    for (std::uint32_t s = 0; s < cell.segment_count; ++s) {
      const std::span<const std::byte> segment =
          bytes.subspan(parts->index->piece_offset(c, s), parts->index->piece_bytes(c, s));
      const Result<void> added = mesh->add_segment(c, s, segment);
      if (!added) return tl::unexpected(with_context(added.error(), name));
    }
  }
  if (const Result<std::uint64_t> refined = mesh->refine(); !refined) {
    return tl::unexpected(with_context(refined.error(), name));
  }
  if (!mesh->is_complete()) return fail(ErrorKind::bad_input, name + ": all segments do not make the whole model");
  return mesh;
}

}  // namespace fanstream::bench
