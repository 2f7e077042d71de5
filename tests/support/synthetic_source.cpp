#include "tests/support/synthetic_source.h"

#include <algorithm>
#include <cstring>
#include <random>

namespace fanstream {

SyntheticSource::SyntheticSource(const SyntheticShape& shape) {
  std::mt19937 random(shape.seed);
  const auto blob = [&](std::size_t size) {
    std::vector<std::byte> bytes(size);
    for (std::size_t i = 0; i < size; i += 4) {
      const std::uint32_t word = static_cast<std::uint32_t>(random());
      std::memcpy(bytes.data() + i, &word, std::min<std::size_t>(4, size - i));
    }
    size_bytes_ += size;
    return bytes;
  };
  head_ = blob(shape.head_bytes);
  index_ = blob(shape.index_bytes);
  cells_.resize(shape.cells);
  for (auto& cell : cells_) {
    cell.resize(random() % (shape.max_segments + 1));
    for (auto& segment : cell) {
      const bool empty = shape.empty_one_in != 0 && random() % shape.empty_one_in == 0;
      segment = blob(empty ? 0 : random() % (shape.max_segment_bytes + 1));
    }
  }
  for (std::uint8_t& byte : digest_) byte = static_cast<std::uint8_t>(random());
  table_ = segment_table(*this);
}

std::uint64_t SyntheticSource::segment_total() const {
  std::uint64_t total = 0;
  for (const auto& cell : cells_) total += cell.size();
  return total;
}

void SyntheticProvider::set(const std::string& name, ModelStatus status) {
  const std::lock_guard lock(mutex_);
  models_[name] = std::move(status);
}

void SyntheticProvider::set_ready(const std::string& name, std::shared_ptr<const SegmentSource> source) {
  set(name, {ModelStatus::State::ready, 1, "", std::move(source)});
}

std::vector<CatalogueEntry> SyntheticProvider::catalogue() {
  const std::lock_guard lock(mutex_);
  std::vector<CatalogueEntry> entries;
  for (const auto& [name, status] : models_) {
    CatalogueEntry entry;
    entry.name = name;
    if (status.state == ModelStatus::State::building) {
      entry.state = ModelState::building;
      entry.permille = static_cast<std::uint16_t>(status.fraction * 1000);
    } else if (status.state == ModelStatus::State::failed) {
      entry.state = ModelState::failed;
      entry.reason = status.reason;
    } else {
      entry.digest = status.source->digest();
      entry.size_bytes = status.source->size_bytes();
      entry.vertex_count = status.source->vertex_count();
      entry.triangle_count = status.source->triangle_count();
    }
    entries.push_back(entry);
  }
  return entries;
}

ModelStatus SyntheticProvider::open(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto found = models_.find(name);
  return found == models_.end() ? ModelStatus{} : found->second;
}

std::shared_ptr<const SegmentTable> segment_table(const SegmentSource& source) {
  auto table = std::make_shared<SegmentTable>();
  for (std::uint32_t cell = 0; cell < source.cell_count(); ++cell) {
    std::vector<std::uint32_t> sizes;
    for (std::uint32_t s = 0; s < source.segment_count(cell); ++s)
      sizes.push_back(static_cast<std::uint32_t>(source.segment(cell, s).size()));
    table->add_cell(sizes);
  }
  return table;
}

ReceivedModel::ReceivedModel(const SegmentSource& source)
    : source_(source), table_(segment_table(source)), held_(source.cell_count(), 0) {}

bool ReceivedModel::add(std::uint32_t cell, std::uint32_t segment, std::span<const std::byte> bytes) {
  if (cell >= held_.size() || held(cell) != segment || segment >= source_.segment_count(cell)) return false;
  held_[cell] = segment + 1;
  ++segments_;
  return std::ranges::equal(bytes, source_.segment(cell, segment));
}

bool ReceivedModel::complete() const {
  for (std::uint32_t cell = 0; cell < held_.size(); ++cell) {
    if (held(cell) != source_.segment_count(cell)) return false;
  }
  return true;
}

}  // namespace fanstream
