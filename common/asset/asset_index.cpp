// The cell table: the index, and the pages that tell of the last slab where it is large.
#include <algorithm>
#include <cmath>

#include "common/asset/asset_layout.h"
#include "common/coding/next_split.h"
#include "common/coding/residual_tables.h"
#include "common/fans/linked_fans.h"

namespace fanstream {
namespace {

// Numbers of the cell table are coded as differences from what is expected of them, each kind with a running mean and
// spread of its own. Written once for both directions.
class RunningNumber {
 public:
  RunningNumber(float mean, float spread) : mean_(mean), spread_(spread) {}
  explicit RunningNumber(const PageStarts::Number& start)
      : RunningNumber(static_cast<float>(start.mean) / 16.0F, static_cast<float>(std::max(4U, start.spread)) / 16.0F) {}
  // Of a number that is mostly about `per` times the mean.
  template <class Coder>
  std::int32_t code(Coder& coder, std::int32_t value, float per = 1.0F) {
    const float expected = mean_ * per;
    const std::int32_t coded = ResidualTables::instance().code(coder, expected, spread_ * spread_, value);
    const float error = static_cast<float>(coded) - expected;
    mean_ += 0.125F * (error / per);
    spread_ += 0.125F * (1.3F * std::fabs(error) - spread_);
    if (spread_ < 0.25F) spread_ = 0.25F;
    return coded;
  }

 private:
  float mean_;
  float spread_;
};

constexpr std::int32_t kMostSegmentWords = 0xFFFFFF;

std::uint8_t last_code(const AssetIndex& index, const CellEntry& cell) {
  return index.segments[cell.first_segment + cell.segment_count - 1].error_code;
}

// Cones and segments of the cells of one slab, or of one page, in order.
class CellContentCoder {
 public:
  explicit CellContentCoder(std::size_t layers)
      : sizes_(layers, RunningNumber(0.5F, 4.0F)), falls_(layers, RunningNumber(4.0F, 4.0F)) {}
  CellContentCoder(const PageStarts& starts, const CodedCone& axis)
      : cone_(axis), widths_(starts.widths), u_(starts.axes), v_(starts.axes) {
    for (const PageStarts::Number& start : starts.sizes) sizes_.emplace_back(start);
    for (const PageStarts::Number& start : starts.falls) falls_.emplace_back(start);
  }

  // `before`: the error code before the first segment. A decoder fills the cell; false if a number is impossible.
  template <class Coder>
  bool code(Coder& coder, std::int32_t before, CellEntry& cell, std::span<SegmentEntry> segments) {
    const bool splits = cell.split_count > 0;
    if (splits && !code_cone_of(coder, cell.cone)) return false;
    for (std::size_t s = 0; s < segments.size(); ++s) {
      SegmentEntry& segment = segments[s];
      std::int32_t size = 0;
      if (splits) {
        size = sizes_[s].code(coder, static_cast<std::int32_t>(segment.size_bytes / 2),
                              static_cast<float>(cell.split_count));
        if (size < 0 || size > kMostSegmentWords) return false;
      }
      segment.size_bytes = 2 * static_cast<std::uint32_t>(size);
      const std::int32_t error = before - falls_[s].code(coder, before - segment.error_code);
      if (error < 0 || error > 255) return false;
      segment.error_code = static_cast<std::uint8_t>(error);
      before = error;
    }
    return true;
  }

 private:
  // The axis as its difference from the last one.
  template <class Coder>
  bool code_cone_of(Coder& coder, CodedCone& cone) {
    const std::int32_t width = widths_.code(coder, cone.width);
    if (width < 0 || width > CodedCone::kWidest) return false;
    cone.width = static_cast<std::uint8_t>(width);
    if (width == 0) return cone = {}, true;
    const std::int32_t u = cone_.u + u_.code(coder, std::int32_t{cone.u} - cone_.u);
    const std::int32_t v = cone_.v + v_.code(coder, std::int32_t{cone.v} - cone_.v);
    if (u < 0 || u >= CodedCone::kPlaces || v < 0 || v >= CodedCone::kPlaces) return false;
    cone.u = static_cast<std::uint8_t>(u);
    cone.v = static_cast<std::uint8_t>(v);
    cone_ = cone;
    return true;
  }

  CodedCone cone_{1, 8, 8};  // the last one
  RunningNumber widths_{4.0F, 2.0F};
  RunningNumber u_{0.0F, 3.0F};
  RunningNumber v_{0.0F, 3.0F};
  std::vector<RunningNumber> sizes_;
  std::vector<RunningNumber> falls_;
};

// One slab's cells in order, where they stand in the index.
class SlabCoder {
 public:
  SlabCoder(const AssetHead& head, std::uint32_t slab)
      : content_(head.layers_of(slab)),
        parents_(slab + 1 < head.slab_count()),
        pages_(head.has_pages && slab + 2 == head.slab_count()) {}

  // `before`: the parent's last error code, 0 in slab 0.
  template <class Coder>
  bool code(Coder& coder, std::int32_t before, CellEntry& cell, std::span<SegmentEntry> segments) {
    const std::int32_t splits = splits_.code(coder, static_cast<std::int32_t>(cell.split_count));
    const std::int32_t children = parents_ ? children_.code(coder, static_cast<std::int32_t>(cell.child_count)) : 0;
    if (splits < 0 || children < 0) return false;
    cell.split_count = static_cast<std::uint32_t>(splits);
    cell.child_count = static_cast<std::uint32_t>(children);
    if (!content_.code(coder, before, cell, segments)) return false;
    return !pages_ || children == 0 || code_page_of(coder, segments.back().error_code, cell);
  }

 private:
  template <class Coder>
  bool code_page_of(Coder& coder, std::int32_t before, CellEntry& cell) {
    const auto per = static_cast<float>(cell.child_count);
    const std::int32_t splits = child_splits_.code(coder, static_cast<std::int32_t>(cell.child_splits), per);
    const std::int32_t rest = before - rest_falls_.code(coder, before - cell.rest_code);
    const std::int32_t words = page_words_.code(coder, static_cast<std::int32_t>(cell.page_bytes / 2), per);
    if (splits < 0 || rest < 0 || rest > 255 || words < 0 || words > kMostSegmentWords) return false;
    cell.child_splits = static_cast<std::uint32_t>(splits);
    cell.rest_code = static_cast<std::uint8_t>(rest);
    cell.page_bytes = 2 * static_cast<std::uint32_t>(words);
    return true;
  }

  CellContentCoder content_;
  bool parents_;
  bool pages_;
  RunningNumber splits_{80.0F, 30.0F};
  RunningNumber children_{3.0F, 1.0F};
  RunningNumber child_splits_{30.0F, 60.0F};
  RunningNumber rest_falls_{4.0F, 4.0F};
  RunningNumber page_words_{3.0F, 5.0F};
};

// From where the axes of a page's cones go on: the parent's, which is coded if it has splits.
CodedCone first_axis(const CellEntry& parent) {
  return parent.split_count > 0 && parent.cone.width != 0 ? parent.cone : CodedCone{1, 8, 8};
}

// The children of one cell, in either direction. Of the splits the last child has what is left.
template <class Coder>
bool code_page(Coder& coder, const PageStarts& starts, const CellEntry& parent, std::span<CellEntry> cells,
               std::span<SegmentEntry> segments) {
  CellContentCoder content(starts, first_axis(parent));
  RunningNumber splits(PageStarts::Number{0, starts.splits.spread});
  auto left = static_cast<std::int32_t>(parent.child_splits);
  const std::size_t layers = starts.sizes.size();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    CellEntry& cell = cells[i];
    const auto children = static_cast<std::int32_t>(cells.size() - i);
    std::int32_t count = left;
    if (children > 1) {
      const std::int32_t usual = left / children;
      count = usual + splits.code(coder, static_cast<std::int32_t>(cell.split_count) - usual);
    }
    if (count < 0 || count > left) return false;
    left -= count;
    cell.split_count = static_cast<std::uint32_t>(count);
    if (!content.code(coder, parent.rest_code, cell, segments.subspan(i * layers, layers))) return false;
  }
  return true;
}

// What a cell's first error code is coded against.
std::int32_t error_before(const AssetIndex& index, const CellEntry& cell) {
  return cell.slab == 0 ? 0 : last_code(index, index.cells[cell.parent]);
}

// Of the vertices of FM0, in either direction. Nothing without generations.
template <class Coder>
void code_base(Coder& coder, const AssetHead& head, std::vector<std::uint8_t>& next_splits) {
  if (head.generation_count() == 0) return;
  const LinkedFans fans(head.base.places.size(), head.base.triangles);
  code_base_splits(coder, SplitModel(head.statistics), fans, head.generation_count(), next_splits);
}

void write_starts(const PageStarts& starts, ByteWriter& out) {
  const auto number = [&](const PageStarts::Number& n) {
    out.varint(n.mean);
    out.varint(n.spread);
  };
  out.varint(starts.splits.spread);
  number(starts.widths);
  out.varint(starts.axes.spread);
  for (const PageStarts::Number& n : starts.sizes) number(n);
  for (const PageStarts::Number& n : starts.falls) number(n);
}

// A mean and spread over many numbers of a kind, as RunningNumber would find them.
class Average {
 public:
  void add(double value, double per = 1.0) { values_.push_back({value, per}); }
  PageStarts::Number number() const {
    double sum = 0.0, pers = 0.0, off = 0.0;
    for (const auto& [value, per] : values_) sum += value, pers += per;
    const double mean = pers > 0.0 ? std::max(0.0, sum / pers) : 0.0;
    for (const auto& [value, per] : values_) off += std::fabs(value - mean * per);
    const double spread = values_.empty() ? 0.0 : 1.3 * off / static_cast<double>(values_.size());
    const auto in_16ths = [](double v) { return static_cast<std::uint32_t>(std::min(std::round(16.0 * v), 1e6)); };
    return {in_16ths(mean), in_16ths(spread)};
  }

 private:
  std::vector<std::pair<double, double>> values_;
};

PageStarts measure_starts(const AssetHead& head, const AssetIndex& index) {
  const std::uint32_t layers = head.layers_of(head.slab_count() - 1);
  Average splits, widths, axes;
  std::vector<Average> sizes(layers), falls(layers);
  CodedCone before{1, 8, 8};
  for (std::size_t c = index.first_paged; c < index.cells.size(); ++c) {
    const CellEntry& cell = index.cells[c];
    const CellEntry& parent = index.cells[cell.parent];
    if (c == parent.first_child) before = first_axis(parent);
    splits.add(static_cast<double>(cell.split_count) - static_cast<double>(parent.child_splits) / parent.child_count);
    if (cell.split_count > 0) {
      widths.add(cell.cone.width);
      if (cell.cone.width != 0) {
        axes.add(cell.cone.u - before.u);
        axes.add(cell.cone.v - before.v);
        before = cell.cone;
      }
    }
    std::int32_t code = parent.rest_code;
    for (std::uint32_t s = 0; s < layers; ++s) {
      const SegmentEntry& segment = index.segments[cell.first_segment + s];
      if (cell.split_count > 0) sizes[s].add(segment.size_bytes / 2.0, cell.split_count);
      falls[s].add(code - segment.error_code);
      code = segment.error_code;
    }
  }
  PageStarts starts{{0, splits.number().spread}, widths.number(), {0, axes.number().spread}, {}, {}};
  for (const Average& a : sizes) starts.sizes.push_back(a.number());
  for (const Average& a : falls) starts.falls.push_back(a.number());
  return starts;
}

void find_pages(const AssetHead& head, AssetIndex& index) {
  if (!head.has_pages) return;
  const std::uint32_t last = head.slab_count() - 1;
  const auto first_of = [&](std::uint32_t slab) {
    const auto at =
        std::find_if(index.cells.begin(), index.cells.end(), [&](const CellEntry& c) { return c.slab >= slab; });
    return static_cast<std::uint32_t>(at - index.cells.begin());
  };
  index.first_page_owner = first_of(last - 1);
  index.first_paged = first_of(last);
}

}  // namespace

std::vector<std::byte> write_pages(const AssetHead& head, AssetIndex& index) {
  std::vector<std::byte> pages;
  if (!head.has_pages) return pages;
  find_pages(head, index);
  for (std::uint32_t c = index.first_page_owner; c < index.first_paged; ++c) {
    CellEntry& parent = index.cells[c];
    parent.child_splits = parent.rest_code = 0;
    for (std::uint32_t i = 0; i < parent.child_count; ++i) {
      const CellEntry& child = index.cells[parent.first_child + i];
      parent.child_splits += child.split_count;
      parent.rest_code = std::max(parent.rest_code, index.segments[child.first_segment].error_code);
    }
  }
  index.page_starts = measure_starts(head, index);
  const std::uint32_t layers = head.layers_of(head.slab_count() - 1);
  for (std::uint32_t c = index.first_page_owner; c < index.first_paged; ++c) {
    CellEntry& parent = index.cells[c];
    parent.page_bytes = 0;
    if (parent.child_count == 0) continue;
    const auto first = index.cells.begin() + parent.first_child;
    std::vector<CellEntry> cells(first, first + parent.child_count);
    const auto first_segment = index.segments.begin() + cells.front().first_segment;
    std::vector<SegmentEntry> segments(first_segment, first_segment + std::ptrdiff_t{parent.child_count} * layers);
    RansEncoder encoder;
    code_page(encoder, index.page_starts, parent, cells, segments);
    const std::vector<std::byte> page = encoder.finish();
    parent.page_bytes = static_cast<std::uint32_t>(page.size());
    pages.insert(pages.end(), page.begin(), page.end());
  }
  return pages;
}

void write_index(const AssetIndex& index, const AssetHead& head, ByteWriter& out) {
  std::vector<std::uint8_t> next_splits = index.base_next_splits;
  RansEncoder base;
  code_base(base, head, next_splits);
  const std::vector<std::byte> base_bytes = base.finish();
  out.varint(base_bytes.size());
  out.bytes(base_bytes);
  const std::size_t listed = std::min<std::size_t>(index.cells.size(), index.first_paged);
  for (std::size_t first = 0; first < listed;) {
    const std::uint32_t slab = index.cells[first].slab;
    SlabCoder coding(head, slab);
    RansEncoder encoder;
    std::size_t end = first;
    for (; end < listed && index.cells[end].slab == slab; ++end) {
      CellEntry cell = index.cells[end];
      std::vector<SegmentEntry> segments(index.segments.begin() + cell.first_segment,
                                         index.segments.begin() + cell.first_segment + cell.segment_count);
      coding.code(encoder, error_before(index, cell), cell, segments);
    }
    const std::vector<std::byte> bytes = encoder.finish();
    out.varint(bytes.size());
    out.bytes(bytes);
    first = end;
  }
  if (head.has_pages) write_starts(index.page_starts, out);
}

namespace {

// Gives segments of the layers of slabs [first_slab, end_slab) their places, from `start` on; returns where they end.
std::uint64_t place_layers(const AssetHead& head, AssetIndex& index, std::uint32_t first_slab, std::uint32_t end_slab,
                           std::uint64_t start) {
  if (first_slab == end_slab) return start;
  const std::uint32_t first_layer = head.layer_begin(first_slab);
  std::vector<std::uint64_t> places(head.slab_ends[end_slab - 1] - first_layer + 1, 0);
  const auto each = [&](auto&& use) {
    for (const CellEntry& cell : index.cells) {
      if (cell.slab < first_slab || cell.slab >= end_slab) continue;
      for (std::uint32_t s = 0; s < cell.segment_count; ++s) {
        use(head.layer_begin(cell.slab) + s - first_layer, cell.first_segment + s);
      }
    }
  };
  each([&](std::uint32_t layer, std::uint32_t s) { places[layer + 1] += index.segments[s].size_bytes; });
  places[0] = start;
  for (std::size_t l = 1; l < places.size(); ++l) places[l] += places[l - 1];
  const std::uint64_t end = places.back();
  if (index.segment_offsets.size() != index.segments.size()) return end;
  each([&](std::uint32_t layer, std::uint32_t s) {
    index.segment_offsets[s] = places[layer];
    places[layer] += index.segments[s].size_bytes;
  });
  return end;
}

class IndexReader {
 public:
  IndexReader(std::span<const std::byte> bytes, const AssetHead& head, const std::string& name)
      : in_(bytes), head_(head), name_(name) {}

  Result<AssetIndex> read(const AssetPreamble& preamble) {
    if (!is_believable(head_.vertex_count, preamble.section_bytes())) {
      return fail(ErrorKind::limit, name_ + ": " + std::to_string(head_.vertex_count) + " vertices in " +
                                        std::to_string(preamble.section_bytes()) +
                                        " bytes are not believed; the asset is forged or damaged");
    }
    if (Result<void> base = read_base(); !base) return tl::unexpected(base.error());
    std::uint64_t slab_cells = head_.root_cell_count;
    std::uint32_t slab_first = 0;
    for (std::uint32_t slab = 0; slab < head_.slab_count(); ++slab) {
      if (slab > 0) slab_cells = count_children(slab_first);
      // Every cell holds a vertex of its own.
      if (slab_cells > head_.vertex_count) return tl::unexpected(in_.error(name_, "more cells than vertices"));
      if (Result<void> size = check_index_size(index_.cells.size() + slab_cells,
                                               index_.segments.size() + slab_cells * head_.layers_of(slab));
          !size) {
        return tl::unexpected(with_context(size.error(), name_));
      }
      const auto first = static_cast<std::uint32_t>(index_.cells.size());
      add_cells(slab, slab_cells);
      if (slab > 0) adopt_children(slab_first, first);
      slab_first = first;
      const bool paged = head_.has_pages && slab + 1 == head_.slab_count();
      if (Result<void> cells = paged ? read_starts() : read_slab(slab, first); !cells) {
        return tl::unexpected(cells.error());
      }
    }
    if (in_.remaining() != 0) return tl::unexpected(in_.error(name_, "bytes left over"));
    if (vertices_ + head_.base.places.size() != head_.vertex_count) {
      return fail(ErrorKind::bad_input, name_ + ": base vertices and splits do not add up to the vertex count");
    }
    return place_segments(preamble);
  }

 private:
  Result<void> read_base() {
    const std::uint64_t size = in_.varint();
    if (in_.failed() || size > in_.remaining()) return tl::unexpected(in_.error(name_, "cut short"));
    RansDecoder decoder(in_.bytes(static_cast<std::size_t>(size)));
    index_.base_next_splits.assign(head_.base.places.size(), kNeverSplit);
    code_base(decoder, head_, index_.base_next_splits);
    if (!decoder.finished_cleanly()) return tl::unexpected(in_.error(name_, "damaged before"));
    for (std::size_t v = 0; v < head_.exact_base.size(); ++v) {
      if ((head_.exact_base[v] != 0) != (index_.base_next_splits[v] == kNeverSplit)) {
        return tl::unexpected(
            in_.error(name_, "vertices of FM0 are split that the head says are not, or the reverse, before"));
      }
    }
    return {};
  }

  std::uint64_t count_children(std::uint32_t slab_first) const {
    std::uint64_t total = 0;
    for (std::size_t p = slab_first; p < index_.cells.size(); ++p) total += index_.cells[p].child_count;
    return total;
  }

  void add_cells(std::uint32_t slab, std::uint64_t count) {
    const std::uint32_t layers = head_.layers_of(slab);
    auto segment = static_cast<std::uint32_t>(index_.segments.size());
    index_.cells.reserve(index_.cells.size() + static_cast<std::size_t>(count));
    for (std::uint64_t i = 0; i < count; ++i, segment += layers) {
      CellEntry& cell = index_.cells.emplace_back();
      cell.slab = slab;
      cell.first_segment = segment;
      cell.segment_count = layers;
    }
    index_.segments.resize(segment, {kUnknownBytes, 0});
  }

  void adopt_children(std::uint32_t parents_first, std::uint32_t parents_end) {
    std::uint32_t child = parents_end;
    for (std::uint32_t p = parents_first; p < parents_end; ++p) {
      index_.cells[p].first_child = child;
      for (std::uint32_t i = 0; i < index_.cells[p].child_count; ++i) index_.cells[child++].parent = p;
    }
  }

  Result<void> read_slab(std::uint32_t slab, std::uint32_t first) {
    const std::uint64_t size = in_.varint();
    if (in_.failed() || size > in_.remaining()) return tl::unexpected(in_.error(name_, "cut short"));
    RansDecoder decoder(in_.bytes(static_cast<std::size_t>(size)));
    SlabCoder coding(head_, slab);
    for (std::size_t c = first; c < index_.cells.size(); ++c) {
      CellEntry& cell = index_.cells[c];
      const bool good = coding.code(decoder, error_before(index_, cell), cell,
                                    std::span(index_.segments).subspan(cell.first_segment, cell.segment_count));
      cell.first_vertex = static_cast<VertexId>(head_.base.places.size() + vertices_);
      vertices_ += cell.split_count;
      if (!good || vertices_ > head_.vertex_count || cell.child_count > head_.vertex_count) {
        return fail(ErrorKind::bad_input, name_ + ": impossible numbers for cell " + std::to_string(c));
      }
    }
    if (!decoder.finished_cleanly()) return tl::unexpected(in_.error(name_, "damaged before"));
    return {};
  }

  Result<void> read_starts() {
    PageStarts& starts = index_.page_starts;
    const auto value = [this] { return static_cast<std::uint32_t>(std::min<std::uint64_t>(in_.varint(), 1U << 20U)); };
    const auto number = [&] {
      const std::uint32_t mean = value();
      return PageStarts::Number{mean, value()};
    };
    starts.splits.spread = value();
    starts.widths = number();
    starts.axes.spread = value();
    const std::uint32_t layers = head_.layers_of(head_.slab_count() - 1);
    for (std::uint32_t l = 0; l < layers; ++l) starts.sizes.push_back(number());
    for (std::uint32_t l = 0; l < layers; ++l) starts.falls.push_back(number());
    if (in_.failed()) return tl::unexpected(in_.error(name_, "cut short"));
    find_pages(head_, index_);
    for (std::uint32_t c = index_.first_page_owner; c < index_.first_paged; ++c) {
      const CellEntry& parent = index_.cells[c];
      if (parent.child_count == 0) continue;
      ++index_.unknown_pages;
      index_.cells[parent.first_child].first_vertex = static_cast<VertexId>(head_.base.places.size() + vertices_);
      vertices_ += parent.child_splits;
      if (vertices_ > head_.vertex_count) {
        return fail(ErrorKind::bad_input, name_ + ": impossible numbers for cell " + std::to_string(c));
      }
    }
    return {};
  }

  Result<AssetIndex> place_segments(const AssetPreamble& preamble) {
    const std::uint32_t slabs = head_.slab_count() - (head_.has_pages ? 1U : 0U);
    index_.segment_offsets.resize(index_.segments.size());
    std::uint64_t at = place_layers(head_, index_, 0, slabs, preamble.head_bytes + preamble.index_bytes);
    if (head_.has_pages) {
      for (std::uint32_t c = index_.first_page_owner; c < index_.first_paged; ++c) {
        index_.cells[c].page_offset = at;
        at += index_.cells[c].page_bytes;
      }
    }
    const std::uint64_t end = preamble.section_bytes();
    const std::uint64_t behind_bytes = head_.polygon_bytes + range_table_bytes(head_, index_);
    if (index_.unknown_pages != 0 ? at + behind_bytes > end : at + behind_bytes != end) {
      return fail(ErrorKind::bad_input, name_ + ": segment sizes do not add up to the segment section");
    }
    index_.paged_offset = at;
    index_.paged_end = end - behind_bytes;
    index_.polygons = {head_.polygon_bytes, 0};
    index_.polygon_offset = index_.paged_end;
    if (!head_.has_pages) return std::move(index_);
    for (std::uint32_t c = index_.first_page_owner; c < index_.first_paged; ++c) {
      if (index_.cells[c].child_count == 0 || index_.cells[c].page_bytes != 0) continue;
      if (Result<void> page = read_page({}, c, head_, index_, name_); !page) return tl::unexpected(page.error());
    }
    return std::move(index_);
  }

  ByteReader in_;
  const AssetHead& head_;
  const std::string& name_;
  AssetIndex index_;
  std::uint64_t vertices_ = 0;  // made by the cells so far
};

}  // namespace

Result<AssetIndex> read_index(std::span<const std::byte> index, const AssetPreamble& preamble, const AssetHead& head,
                              const std::string& name) {
  return IndexReader(index, head, name + ": cell table").read(preamble);
}

Result<void> read_page(std::span<const std::byte> page, std::uint32_t cell, const AssetHead& head, AssetIndex& index,
                       const std::string& name) {
  const auto refuse = [&](const char* why) {
    return fail(ErrorKind::bad_input, name + ": the page of cell " + std::to_string(cell) + why);
  };
  if (cell >= index.cells.size() || !index.has_page(cell)) return refuse(" does not exist in this asset");
  const CellEntry& parent = index.cells[cell];
  if (page.size() != parent.page_bytes) return refuse(" has another size than the cell table says");
  if (index.knows_children(cell)) return {};
  const auto first = index.cells.begin() + parent.first_child;
  std::vector<CellEntry> cells(first, first + parent.child_count);
  const std::size_t layers = index.page_starts.sizes.size();
  std::vector<SegmentEntry> segments(parent.child_count * layers);
  RansDecoder decoder(page);
  if (!code_page(decoder, index.page_starts, parent, cells, segments)) return refuse(" has impossible numbers");
  if (!decoder.finished_cleanly()) return refuse(" is damaged");
  VertexId vertex = first->first_vertex;
  std::uint8_t largest = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    cells[i].first_vertex = vertex;
    vertex += cells[i].split_count;
    for (std::size_t s = 0; s < layers; ++s) {
      const std::uint8_t before = s == 0 ? parent.rest_code : segments[i * layers + s - 1].error_code;
      if (segments[i * layers + s].error_code > before) return refuse(" has error bounds that rise");
    }
    largest = std::max(largest, segments[i * layers].error_code);
  }
  if (largest != parent.rest_code) return refuse(" has error bounds below what is announced");
  std::uint64_t bytes = index.paged_known_bytes;
  for (const SegmentEntry& segment : segments) bytes += segment.size_bytes;
  const std::uint64_t all_bytes = index.paged_end - index.paged_offset;
  if (index.unknown_pages == 1 ? bytes != all_bytes : bytes > all_bytes) {
    return refuse(" has sizes that do not add up to the segment section");
  }
  std::copy(cells.begin(), cells.end(), first);
  std::copy(segments.begin(), segments.end(), index.segments.begin() + cells.front().first_segment);
  index.paged_known_bytes = bytes;
  if (--index.unknown_pages != 0) return {};
  const std::uint32_t last = head.slab_count() - 1;
  place_layers(head, index, last, last + 1, index.paged_offset);
  return {};
}

Result<AssetIndex> read_whole_index(std::span<const std::byte> sections, const AssetPreamble& preamble,
                                    const AssetHead& head, const std::string& name) {
  Result<AssetIndex> index =
      read_index(sections.subspan(preamble.head_bytes, preamble.index_bytes), preamble, head, name);
  if (!index || !head.has_pages) return index;
  for (std::uint32_t c = index->first_page_owner; c < index->first_paged; ++c) {
    const CellEntry& cell = index->cells[c];
    if (cell.page_bytes == 0) continue;
    const auto page = sections.subspan(static_cast<std::size_t>(cell.page_offset), cell.page_bytes);
    if (Result<void> read = read_page(page, c, head, *index, name); !read) return tl::unexpected(read.error());
  }
  const std::vector<std::byte> table = range_table(head, *index);
  const auto found = sections.first(static_cast<std::size_t>(preamble.section_bytes())).last(table.size());
  if (!std::equal(table.begin(), table.end(), found.begin())) {
    return fail(ErrorKind::bad_input, name + ": the table of ranges does not say where the segments lie");
  }
  return index;
}

std::uint64_t range_table_bytes(const AssetHead& head, const AssetIndex& index) {
  if (!head.has_pages) return 0;
  const std::uint64_t parents = index.first_paged - index.first_page_owner;
  return (parents + kRangeParents - 1) / kRangeParents * head.layers_of(head.slab_count() - 1) * 4;
}

std::vector<std::byte> range_table(const AssetHead& head, const AssetIndex& index) {
  if (!head.has_pages) return {};
  const std::uint32_t layers = head.layers_of(head.slab_count() - 1);
  std::vector<std::uint32_t> sums((index.first_paged - index.first_page_owner + kRangeParents - 1) / kRangeParents *
                                  layers);
  for (std::size_t c = index.first_paged; c < index.cells.size(); ++c) {
    const CellEntry& cell = index.cells[c];
    const std::uint32_t group = (cell.parent - index.first_page_owner) / kRangeParents;
    for (std::uint32_t s = 0; s < layers; ++s) {
      sums[group * layers + s] += index.segments[cell.first_segment + s].size_bytes;
    }
  }
  ByteWriter out;
  for (const std::uint32_t sum : sums) out.u32(sum);
  return out.take();
}

}  // namespace fanstream
