// An asset of random bytes, for tests of everything that takes blobs as they are.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/asset/segment_source.h"
#include "protocol/segment_table.h"
#include "server/net/model_provider.h"

namespace fanstream {

struct SyntheticShape {
  std::uint32_t seed = 1;
  std::uint32_t cells = 50;
  std::uint32_t max_segments = 6;         // 0 to this many per cell
  std::uint32_t max_segment_bytes = 900;  // 0 to this many
  std::size_t head_bytes = 3000;
  std::size_t index_bytes = 700;
  std::uint32_t empty_one_in = 5;  // segments have no bytes; 0: only by chance
};

class SyntheticSource final : public SegmentSource {
 public:
  explicit SyntheticSource(const SyntheticShape& shape);
  Digest digest() const override { return digest_; }
  std::span<const std::byte> head() const override { return head_; }
  std::span<const std::byte> index() const override { return index_; }
  std::uint32_t cell_count() const override { return static_cast<std::uint32_t>(cells_.size()); }
  std::uint32_t segment_count(std::uint32_t cell) const override {
    return static_cast<std::uint32_t>(cells_[cell].size());
  }
  std::span<const std::byte> segment(std::uint32_t cell, std::uint32_t segment) const override {
    return cells_[cell][segment];
  }
  std::uint64_t vertex_count() const override { return 1000; }
  std::uint64_t triangle_count() const override { return 2000; }
  std::uint64_t size_bytes() const override { return size_bytes_; }

  std::uint64_t segment_total() const;
  std::uint64_t nonempty_total() const { return table_->nonempty_total(); }  // that are sent
  std::shared_ptr<const SegmentTable> table() const { return table_; }

 private:
  Digest digest_{};
  std::vector<std::byte> head_, index_;
  std::vector<std::vector<std::vector<std::byte>>> cells_;
  std::shared_ptr<const SegmentTable> table_;
  std::uint64_t size_bytes_ = 0;
};

std::shared_ptr<const SegmentTable> segment_table(const SegmentSource& source);

// Models by name; a test changes their state while clients wait.
class SyntheticProvider final : public ModelProvider {
 public:
  void set(const std::string& name, ModelStatus status);
  void set_ready(const std::string& name, std::shared_ptr<const SegmentSource> source);
  std::vector<CatalogueEntry> catalogue() override;
  ModelStatus open(const std::string& name) override;

 private:
  std::mutex mutex_;
  std::map<std::string, ModelStatus> models_;
};

// What a client received of a source, to be compared with it.
class ReceivedModel {
 public:
  explicit ReceivedModel(const SegmentSource& source);
  // False if the segment is not the next of its cell that has bytes, or its bytes are wrong.
  bool add(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes);
  bool complete() const;
  std::uint64_t segments() const { return segments_; }
  std::uint32_t held(std::uint32_t cell) const { return table_->next_to_send(cell, held_[cell]); }

 private:
  const SegmentSource& source_;
  std::shared_ptr<const SegmentTable> table_;
  std::vector<std::uint32_t> held_;
  std::uint64_t segments_ = 0;
};

}  // namespace fanstream
