#include "server/build/asset_builder.h"

#include <xxhash.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "common/coding/base_places.h"
#include "server/build/base_matching.h"
#include "server/build/cell_grower.h"
#include "server/build/cell_surface.h"
#include "server/build/error_levels.h"
#include "server/build/layer_plan.h"
#include "server/build/polygon_encoding.h"
#include "server/build/precision_choice.h"
#include "server/build/split_training.h"
#include "server/build/surface_error.h"

namespace fanstream {
namespace {

Granularity granularity_of(const TriangleMesh& mesh, const BuildOptions& options) {
  const Granularity usual = default_granularity(static_cast<std::uint32_t>(mesh.positions.size()));
  return {options.cell_vertices.value_or(usual.cell_vertices),
          options.slab_growth.value_or(usual.slab_growth),
          options.segment_splits.value_or(usual.segment_splits),
          options.edges_per_vertex.value_or(usual.edges_per_vertex),
          options.evenness.value_or(usual.evenness),
          options.distance_growth.value_or(usual.distance_growth),
          options.fine_share.value_or(usual.fine_share)};
}

// A 256th of the model. Handles add faces that no merge takes away (faces less twice the vertices stay the same), and
// more than 2.07 faces a vertex are hardly drawn with 2.9 issued vertices each: such models stop earlier, at 1 % or
// 400.
std::uint32_t default_base_vertices(const TriangleMesh& mesh) {
  const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
  const std::int64_t excess = static_cast<std::int64_t>(mesh.triangles.size()) - 2 * std::int64_t{vertices};
  const std::int64_t few_handles = std::min<std::int64_t>(14 * excess, std::max(400U, vertices / 100U));
  const std::uint32_t usual = std::clamp(vertices / 256U, 48U, 256U);
  return std::max(usual, static_cast<std::uint32_t>(std::max<std::int64_t>(0, few_handles)));
}

class Builder {
 public:
  Builder(const TriangleMesh& mesh, const BuildOptions& options)
      : mesh_(mesh), options_(options), granularity_(granularity_of(mesh, options)) {}

  Result<SplitSample> sample() {
    if (Result<void> checked = check_cost_options(options_.cost); !checked) return tl::unexpected(checked.error());
    describe();
    const MergeHistory history = run_simplify();
    choose_precision_of(history);
    const CodedHistory coded(history, coded_places_, head_.grid, head_.precision);
    plan(history);
    if (Result<void> base = code_base(coded); !base) return tl::unexpected(base.error());
    return observe(coded, SplitModel::untied());
  }

  MergeHistory history() {
    describe();
    return run_simplify();
  }

  Result<BuiltAsset> build() {
    if (mesh_.positions.size() > kMostVertices) {
      return fail(ErrorKind::limit,
                  std::to_string(mesh_.positions.size()) + " vertices, the limit is " + std::to_string(kMostVertices));
    }
    if (mesh_.triangles.empty()) return fail(ErrorKind::bad_input, "no triangles left after cleaning");
    if (Result<void> checked = check_cost_options(options_.cost); !checked) return tl::unexpected(checked.error());
    describe();
    const MergeHistory history = run_simplify();
    choose_precision_of(history);
    const CodedHistory coded(history, coded_places_, head_.grid, head_.precision);
    std::future<SurfaceErrors> surface = start_measuring_surface(placed(), coded);
    plan(history);
    if (Result<void> base = code_base(coded); !base) return tl::unexpected(base.error());
    if (Result<void> trained = train(coded); !trained) return tl::unexpected(trained.error());
    if (Result<void> encoded = encode(coded, surface); !encoded) return tl::unexpected(encoded.error());
    return assemble(history);
  }

 private:
  void report(std::string_view stage, double fraction) const {
    if (options_.progress) options_.progress(stage, fraction);
  }

  void describe() {
    head_.vertex_count = static_cast<std::uint32_t>(mesh_.positions.size());
    head_.triangle_count = static_cast<std::uint32_t>(mesh_.triangles.size());
    head_.component_count = static_cast<std::uint32_t>(count_components(mesh_.positions.size(), mesh_.triangles));
    head_.grid = PositionGrid::fit(mesh_.positions, options_.position_bits.value_or(PositionGrid::default_bits(mesh_)));
    for (const glm::dvec3& p : mesh_.positions) coded_places_.push_back(head_.grid.encode(p));
  }

  // Made when it is first asked for.
  const PlacedMesh& placed() {
    if (!placed_) placed_.emplace(mesh_.triangles, coded_places_, head_.grid);
    return *placed_;
  }

  MergeHistory run_simplify() {
    SimplifyOptions simplify_options = simplify_options_of(mesh_, options_);
    simplify_options.progress = [this](double fraction) { report("simplify", fraction); };
    MergeHistory history = simplify(mesh_, simplify_options);
    if (granularity_.fine_share >= 1.0) return history;
    report("order by error", 0.0);
    const CodedHistory coded(history, coded_places_, head_.grid);
    return level_by_error(placed(), coded, {granularity_.fine_share});
  }

  void choose_precision_of(const MergeHistory& history) {
    head_.precision = choose_precision(mesh_, history, head_.grid, options_.place_noise);
  }

  void plan(const MergeHistory& history) {
    std::vector<std::uint32_t> vertices{history.base_vertices};
    for (std::uint32_t g = history.generation_count(); g-- > 0;) {
      vertices.push_back(head_.vertex_count - history.generation_begin[g]);
    }
    const LayerPlan layers = plan_layers(vertices, granularity_);
    head_.layer_ends = layers.layer_ends;
    head_.slab_ends = layers.slab_ends;
    if (!layers.layer_ends.empty()) {
      head_.root_cell_count = CellGrower::parts_for(history.base_vertices, granularity_.cell_vertices);
    }
  }

  Result<void> code_base(const CodedHistory& coded) {
    std::vector<VertexId> numbers;
    const PlaceLattice& lattice = head_.precision.lattice(0);
    const BaseMesh shown = coded.base(numbers);
    const BaseMesh base = base_on_lattice(shown, lattice);
    Result<std::vector<std::byte>> bytes = encode_base(base);
    if (!bytes) return tl::unexpected(bytes.error());
    Result<BaseMesh> decoded = decode_base(*bytes, head_.vertex_count);
    if (!decoded) return tl::unexpected(with_context(decoded.error(), "reading back the base"));
    Result<std::vector<VertexId>> order = match_base(base, *decoded);
    if (!order) return tl::unexpected(order.error());
    base_numbers_.clear();
    for (const VertexId v : *order) base_numbers_.push_back(numbers[v]);
    head_.base = std::move(*decoded);
    for (std::size_t v = 0; v < order->size(); ++v) head_.base.places[v] = shown.places[(*order)[v]];
    if (!lattice.is_exact()) {
      std::vector<bool> is_root(mesh_.positions.size(), false);
      for (const MergeRecord& merge : coded.history.merges) is_root[merge.root] = true;
      for (const VertexId v : base_numbers_) head_.exact_base.push_back(is_root[v] ? 0 : 1);
    }
    base_bytes_ = std::move(*bytes);
    return {};
  }

  Result<void> train(const CodedHistory& coded) {
    report("learn statistics", 0.0);
    if (coded.has_free_parents()) head_.statistics.allow_free_parents();
    Result<SplitSample> sample = observe(coded, SplitModel(head_.statistics));
    if (!sample) return tl::unexpected(sample.error());
    learn_symbols(sample->counts, head_.statistics);
    sample->geometry.learn(head_.statistics);
    return {};
  }

  // Counts by the model's tables.
  Result<SplitSample> observe(const CodedHistory& coded, const SplitModel& model) const {
    CountingCoder counter(model);
    SplitSample sample{{}, GeometryTraining(coded.history.merges.size())};
    CellGrower grower(head_, coded, base_numbers_, granularity_.cell_vertices);
    if (head_.generation_count() > 0) {
      std::vector<std::uint8_t> next_splits = grower.next_splits_of_base();
      code_base_splits(counter, model, grower.state().fans, head_.generation_count(), next_splits);
    }
    Result<void> replayed = grower.replay(
        model, [&](std::uint32_t) -> CountingCoder& { return counter; },
        [&](const RingGeometry& ring, const FanSplit& split, const MergeRecord& merge) {
          const auto number = static_cast<std::uint32_t>(&merge - coded.history.merges.data());
          const std::uint32_t generation = coded.generation_of(number);
          const PlaceLattice& lattice = coded.precision.lattice(generation);
          sample.geometry.observe(ring, split, head_.grid.unit() * lattice.cell_size(),
                                  CodingPhase::of(generation, head_.generation_count()));
        },
        [](std::uint32_t, std::uint32_t) {});
    if (!replayed) return tl::unexpected(replayed.error());
    sample.counts = counter.counts();
    return sample;
  }

  Result<void> encode(const CodedHistory& coded, std::future<SurfaceErrors>& errors) {
    // What nobody measures meanwhile is best measured while little memory is in use.
    if (errors.wait_for(std::chrono::seconds(0)) == std::future_status::deferred) errors.wait();
    const SplitModel model(head_.statistics);
    CellGrower grower(head_, coded, base_numbers_, granularity_.cell_vertices);
    std::vector<std::uint8_t> base_next_splits = grower.next_splits_of_base();
    std::vector<RansEncoder> encoders;
    std::vector<std::vector<std::vector<std::byte>>> by_cell;  // [cell][layer of its slab]
    CellSurface surface;
    const auto encoder = [&](std::uint32_t cell) -> RansEncoder& {
      if (cell >= encoders.size()) encoders.resize(cell + 1);
      return encoders[cell];
    };
    Result<void> replayed = grower.replay(
        model, encoder,
        [&](const RingGeometry&, const FanSplit& split, const MergeRecord& merge) {
          const std::ptrdiff_t number = &merge - coded.history.merges.data();
          surface.add(grower.state().cells[split.root], static_cast<std::uint32_t>(number));
        },
        [&](std::uint32_t layer, std::uint32_t cell) {
          surface.end_layer(cell);
          if (std::ranges::find(head_.slab_ends, layer + 1) == head_.slab_ends.end()) {
            encoder(cell).cut();
          } else {
            if (cell >= by_cell.size()) by_cell.resize(cell + 1);
            by_cell[cell] = encoder(cell).finish_segments();
            encoder(cell) = {};  // its memory too
          }
          if (layer + 1 == head_.layer_ends.size()) report("encode", 1.0);
        });
    if (!replayed) return replayed;
    index_.cells = grower.cells();
    index_.base_next_splits = std::move(base_next_splits);
    report("measure errors", 0.0);
    surface.finish(errors.get(), index_.cells);
    fill_index(by_cell, surface);
    if (Result<void> size = check_index_size(index_.cells.size(), index_.segments.size()); !size) return size;
    const std::uint32_t slabs = head_.slab_count();
    const auto last_cells = std::count_if(index_.cells.begin(), index_.cells.end(),
                                          [&](const CellEntry& cell) { return cell.slab + 1 == slabs; });
    head_.has_pages = slabs > 1 && last_cells >= options_.paged_cells;
    pages_ = write_pages(head_, index_);
    return encode_polygons_of(grower);
  }

  Result<void> encode_polygons_of(const CellGrower& grower) {
    if (options_.source_faces.empty()) return {};
    std::vector<VertexId> number(mesh_.positions.size());
    for (VertexId v = 0; v < number.size(); ++v) number[grower.original(v)] = v;
    std::vector<Triangle> triangles = mesh_.triangles;
    for (Triangle& t : triangles) t = {number[t[0]], number[t[1]], number[t[2]]};
    const auto section = encode_polygons(grower.state(), head_.grid.unit(), index_, triangles, options_.source_faces);
    if (!section) return {};
    ByteWriter out;
    write_polygons(*section, out);
    if (out.size() > kMostPolygonBytes) {
      return fail(ErrorKind::limit, "the polygons take " + std::to_string(out.size()) + " bytes, the limit is " +
                                        std::to_string(kMostPolygonBytes) + "; triangulate the model");
    }
    polygon_bytes_ = out.take();
    quads_ = section->quads;
    larger_polygons_ = section->larger;
    head_.polygon_bytes = static_cast<std::uint32_t>(polygon_bytes_.size());
    return {};
  }

  void fill_index(const std::vector<std::vector<std::vector<std::byte>>>& by_cell, const CellSurface& surface) {
    layer_segments_.resize(head_.layer_ends.size());
    for (std::uint32_t c = 0; c < index_.cells.size(); ++c) {
      CellEntry& cell = index_.cells[c];
      cell.cone = surface.cone(c);
      cell.first_segment = static_cast<std::uint32_t>(index_.segments.size());
      cell.segment_count = static_cast<std::uint32_t>(by_cell[c].size());
      for (std::uint32_t s = 0; s < cell.segment_count; ++s) {
        SegmentEntry entry;
        entry.size_bytes = static_cast<std::uint32_t>(by_cell[c][s].size());
        entry.error_code = code_of_error(surface.error(c, s), head_.grid.step());
        index_.segments.push_back(entry);
        auto& out = layer_segments_[head_.layer_begin(cell.slab) + s];
        out.insert(out.end(), by_cell[c][s].begin(), by_cell[c][s].end());
      }
    }
  }

  Result<BuiltAsset> assemble(const MergeHistory& history) {
    ByteWriter head;
    write_head(head_, base_bytes_, head);
    ByteWriter index;
    write_index(index_, head_, index);
    AssetPreamble preamble;
    preamble.head_bytes = kPreambleBytes + head.size();
    preamble.index_bytes = index.size();
    ByteWriter body;
    body.bytes(head.view());
    body.bytes(index.view());
    const std::uint32_t last_slab = head_.slab_count() - 1;
    for (std::uint32_t layer = 0; layer < layer_segments_.size(); ++layer) {
      if (layer == head_.layer_begin(last_slab)) body.bytes(pages_);
      body.bytes(layer_segments_[layer]);
    }
    body.bytes(polygon_bytes_);
    body.bytes(range_table(head_, index_));
    preamble.segment_bytes = body.size() - head.size() - index.size();
    BuiltAsset built;
    built.bytes = assemble_file(preamble, body.view());
    fill_report(built, history);
    return built;
  }

  void fill_report(BuiltAsset& built, const MergeHistory& history) const {
    BuildReport& r = built.report;
    r.vertices = head_.vertex_count;
    r.triangles = head_.triangle_count;
    r.components = head_.component_count;
    r.position_bits = head_.grid.bits();
    r.generations = history.generation_count();
    r.base_vertices = static_cast<std::uint32_t>(head_.base.places.size());
    r.base_triangles = static_cast<std::uint32_t>(head_.base.triangles.size());
    r.splits = r.vertices - r.base_vertices;
    r.cells = static_cast<std::uint32_t>(index_.cells.size());
    r.segments = static_cast<std::uint32_t>(std::count_if(index_.segments.begin(), index_.segments.end(),
                                                          [](const SegmentEntry& s) { return s.size_bytes != 0; }));
    r.total_bytes = built.bytes.size();
    r.base_bytes = base_bytes_.size();
    r.polygon_bytes = polygon_bytes_.size();
    r.quads = quads_;
    r.larger_polygons = larger_polygons_;
    for (const SegmentEntry& segment : index_.segments) r.split_bytes += segment.size_bytes;
    r.table_bytes = r.total_bytes - r.base_bytes - r.split_bytes - r.polygon_bytes;
  }

  const TriangleMesh& mesh_;
  const BuildOptions& options_;
  Granularity granularity_;
  AssetHead head_;
  AssetIndex index_;
  std::vector<GridPoint> coded_places_;  // of the model's vertices
  std::optional<PlacedMesh> placed_;
  std::vector<VertexId> base_numbers_;  // the model's vertex of each base vertex
  std::vector<std::byte> base_bytes_;
  std::vector<std::vector<std::byte>> layer_segments_;
  std::vector<std::byte> polygon_bytes_;
  std::uint64_t quads_ = 0, larger_polygons_ = 0;
  std::vector<std::byte> pages_;
};

}  // namespace

Result<BuiltAsset> build_asset(const TriangleMesh& mesh, const BuildOptions& options) {
  return Builder(mesh, options).build();
}

MergeHistory merge_history_of(const TriangleMesh& mesh, const BuildOptions& options) {
  return Builder(mesh, options).history();
}

SimplifyOptions simplify_options_of(const TriangleMesh& mesh, const BuildOptions& options) {
  const Granularity granularity = granularity_of(mesh, options);
  SimplifyOptions result;
  result.base_vertices = options.base_vertices.value_or(default_base_vertices(mesh));
  result.edges_per_vertex = granularity.edges_per_vertex;
  result.evenness = granularity.evenness;
  result.distance_growth = granularity.distance_growth;
  result.cost = options.cost;
  return result;
}

Result<SplitSample> sample_splits(const TriangleMesh& mesh, const BuildOptions& options) {
  return Builder(mesh, options).sample();
}

}  // namespace fanstream
