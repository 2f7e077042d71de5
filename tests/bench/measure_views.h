// Everything that fanstream-bench views tells of one model, measured in one run.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/build/asset_builder.h"
#include "tests/bench/close_up.h"
#include "tests/bench/first_image.h"
#include "tests/bench/forced_share.h"
#include "tests/bench/move_rate.h"
#include "tests/bench/rate_distortion.h"
#include "tests/bench/view_bytes.h"
#include "tests/bench/view_peer.h"

namespace fanstream::bench {

enum class ViewsPart : std::uint8_t { bytes, peers, forced, link, rates, moves, memory, planner };
inline constexpr std::array kAllViewsParts{ViewsPart::bytes, ViewsPart::peers, ViewsPart::forced, ViewsPart::link,
                                           ViewsPart::rates, ViewsPart::moves, ViewsPart::memory, ViewsPart::planner};

struct ViewsOptions {
  std::optional<int> position_bits;  // default: as the builder's
  std::vector<ViewsPart> parts{kAllViewsParts.begin(), kAllViewsParts.end()};
  int repetitions = 5;  // of what is timed; the median counts
  std::uint32_t disc_seeds = 16;
  std::size_t face_samples = 200'000;
  std::vector<double> tolerances_px{8.0, 4.0, 2.0, 1.0};
  std::vector<double> rms{1e-3, 5e-4, 2e-4};
  VirtualLinkOptions link = symmetric_link(10.0, 50.0);
  std::function<void(std::string_view stage)> progress;  // may be empty
};

struct ViewsFigures {
  std::string model;  // the file's name without folder and extension
  BuildReport build;
  std::uint64_t head_bytes = 0, index_bytes = 0;
  std::uint64_t draco_bytes = 0;  // level 10
  double draco_decode_s = 0.0;
  // By tolerance; with plain_criteria(), and with the client's defaults.
  std::vector<ViewBytes> plain, usual;
  std::vector<ViewBesidePeer> beside_peer;   // by tolerance
  std::optional<ForcedShare> disc1, disc10;  // 1 % and 10 % of the vertices
  std::vector<CloseUp> close_ups;            // to a tenth of all the surface, and of what faces the eye
  std::optional<FirstImage> image;
  std::optional<RateCurve> rates;
  std::optional<MoveRates> moves;
  std::optional<ClientMemory> view_memory, full_memory;
  std::optional<PlanTime> plan_time;

  // Head and index with it.
  std::uint64_t total_bytes(const ViewBytes& view) const { return head_bytes + index_bytes + view.segment_bytes; }
  double draco_share(const ViewBytes& view) const {
    return static_cast<double>(total_bytes(view)) / static_cast<double>(draco_bytes);
  }
};

// Imports, cleans, builds, and plays the client. Figures of parts that are not asked for stay empty. Fails, naming the
// file, where something that is measured does not come about. Single-threaded but for the build.
Result<ViewsFigures> measure_views(const std::filesystem::path& path, const ViewsOptions& options);

}  // namespace fanstream::bench
