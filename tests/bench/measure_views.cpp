#include "tests/bench/measure_views.h"

#include <fmt/format.h>

#include <algorithm>

#include "tests/bench/cleaned_mesh.h"

namespace fanstream::bench {

namespace {

constexpr double kCloseUpShare = 0.1;

class Measurement {
 public:
  Measurement(const std::filesystem::path& path, const ViewsOptions& options) : path_(path), options_(options) {
    figures_.model = path.stem().string();
  }

  Result<ViewsFigures> run() {
    if (Result<void> done = build(); !done) return tl::unexpected(named(done.error()));
    using Step = Result<void> (Measurement::*)();
    constexpr std::pair<ViewsPart, Step> kSteps[] = {
        {ViewsPart::memory, &Measurement::memory},  // first: the less was done before, the fewer remains of pages
        {ViewsPart::bytes, &Measurement::bytes},    {ViewsPart::peers, &Measurement::peers},
        {ViewsPart::forced, &Measurement::forced},  {ViewsPart::link, &Measurement::link},
        {ViewsPart::rates, &Measurement::rates},    {ViewsPart::moves, &Measurement::moves},
        {ViewsPart::planner, &Measurement::planner}};
    for (const auto& [part, step] : kSteps) {
      if (std::find(options_.parts.begin(), options_.parts.end(), part) == options_.parts.end()) continue;
      if (Result<void> done = (this->*step)(); !done) return tl::unexpected(named(done.error()));
    }
    return std::move(figures_);
  }

 private:
  void tell(std::string_view stage) const {
    if (options_.progress) options_.progress(stage);
  }

  // The importer's errors name the file already.
  Error named(const Error& error) const {
    const bool is_named = error.message.compare(0, path_.string().size(), path_.string()) == 0;
    return is_named ? error : with_context(error, path_.string());
  }

  Result<void> build() {
    tell("build");
    std::vector<std::byte> bytes;
    {
      const Result<TriangleMesh> mesh = cleaned_mesh(path_);
      if (!mesh) return tl::unexpected(mesh.error());
      BuildOptions build_options;
      build_options.position_bits = options_.position_bits;
      Result<BuiltAsset> built = build_asset(*mesh, build_options);
      if (!built) return tl::unexpected(built.error());
      figures_.build = built->report;
      bytes = std::move(built->bytes);
    }
    Result<std::unique_ptr<ProgressiveMesh>> rebuilt = rebuild_fully(bytes, "the asset just built");
    if (!rebuilt) return tl::unexpected(rebuilt.error());
    full_ = (*rebuilt)->triangle_mesh();
    view_ = whole_view(full_.positions);
    Result<std::shared_ptr<const OpenAsset>> asset = OpenAsset::open(std::move(bytes), "the asset just built");
    if (!asset) return tl::unexpected(asset.error());
    asset_ = std::move(*asset);
    figures_.head_bytes = asset_->head().size();
    figures_.index_bytes = asset_->index().size();
    return draco();
  }

  Result<void> draco() {
    tell("Draco");
    const Result<GridMesh> grid = grid_mesh(full_, asset_->asset_head()->grid.step());
    if (!grid) return tl::unexpected(grid.error());
    Result<DracoFile> file = make_draco_file(*grid, 10, options_.repetitions);
    if (!file) return tl::unexpected(file.error());
    draco_ = std::move(*file);
    figures_.draco_bytes = draco_.bytes.size();
    figures_.draco_decode_s = draco_.decode_seconds;
    return {};
  }

  PlanOptions plain(double tolerance_px) const {
    PlanOptions options;
    options.criteria = plain_criteria();
    options.tolerance_px = tolerance_px;
    return options;
  }

  Result<void> memory() {
    tell("memory");
    Result<ClientMemory> seen = measure_client_memory(asset_, view_, {}, StopAt::stated_error);
    if (!seen) return tl::unexpected(with_context(seen.error(), "memory of a view"));
    Result<ClientMemory> all = measure_client_memory(asset_, view_, everything_wanted(), StopAt::nothing_wanted);
    if (!all) return tl::unexpected(with_context(all.error(), "memory of the full model"));
    figures_.view_memory = *seen;
    figures_.full_memory = *all;
    return {};
  }

  Result<void> bytes() {
    for (const double tolerance_px : options_.tolerances_px) {
      tell(fmt::format("bytes to {} px", tolerance_px));
      PlanOptions usual;
      usual.tolerance_px = tolerance_px;
      for (const auto& [plan, results] : {std::pair{plain(tolerance_px), &figures_.plain}, {usual, &figures_.usual}}) {
        Result<ViewDelivery> delivery = ViewDelivery::start(asset_);
        if (!delivery) return tl::unexpected(delivery.error());
        const Result<ViewBytes> delivered = delivery->deliver(view_, plan, StopAt::stated_error);
        if (!delivered) return tl::unexpected(delivered.error());
        results->push_back(*delivered);
      }
    }
    return {};
  }

  Result<void> peers() {
    tell("the peer's levels for the view");
    Result<std::vector<ViewBesidePeer>> measured =
        measure_views_beside_peer(asset_, full_, view_, options_.tolerances_px, options_.face_samples);
    if (!measured) return tl::unexpected(measured.error());
    figures_.beside_peer = std::move(*measured);
    return {};
  }

  Result<void> forced() {
    tell("forced share");
    const Result<SplitDependencies> dependencies = SplitDependencies::of(asset_);
    if (!dependencies) return tl::unexpected(dependencies.error());
    figures_.disc1 = forced_share(*dependencies, 0.01, options_.disc_seeds);
    figures_.disc10 = forced_share(*dependencies, 0.10, options_.disc_seeds);
    tell("close-up");
    for (const Counted counted : {Counted::all, Counted::facing}) {
      Result<CloseUp> close_up = measure_close_up(asset_, full_, kCloseUpShare, counted, 1.0);
      if (!close_up) return tl::unexpected(with_context(close_up.error(), "close-up"));
      figures_.close_ups.push_back(*close_up);
    }
    return {};
  }

  Result<void> link() {
    tell("first image");
    Result<FirstImage> image = measure_first_image(asset_, draco_, options_.link, options_.repetitions);
    if (!image) return tl::unexpected(image.error());
    figures_.image = *image;
    return {};
  }

  Result<void> rates() {
    tell("rate against distortion");
    Result<RateCurve> curve = measure_rates(asset_, options_.rms, options_.face_samples);
    if (!curve) return tl::unexpected(curve.error());
    figures_.rates = std::move(*curve);
    return {};
  }

  Result<void> moves() {
    tell("apply and undo");
    Result<MoveRates> measured = measure_move_rates(*asset_, options_.repetitions);
    if (!measured) return tl::unexpected(measured.error());
    figures_.moves = *measured;
    return {};
  }

  Result<void> planner() {
    tell("planner");
    Result<PlanTime> time = measure_plan_time(asset_, view_, {}, 10 * options_.repetitions);
    if (!time) return tl::unexpected(with_context(time.error(), "planner"));
    figures_.plan_time = *time;
    return {};
  }

  const std::filesystem::path& path_;
  const ViewsOptions& options_;
  ViewsFigures figures_;
  TriangleMesh full_;  // on the grid, in the model's coordinates
  View view_;
  DracoFile draco_;
  std::shared_ptr<const OpenAsset> asset_;
};

}  // namespace

Result<ViewsFigures> measure_views(const std::filesystem::path& path, const ViewsOptions& options) {
  return Measurement(path, options).run();
}

}  // namespace fanstream::bench
