// What a session did, frame by frame, and what it comes to: for tables, programs and people.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/session/draco_peer.h"

namespace fanstream {

enum class ViewState {
  progressing,  // what the view needs is under way
  complete,     // the stated error is within the tolerance asked for
  degraded,     // it is not and will not be, for the reason given
};
std::string_view name(ViewState state);

struct PictureDifference {
  double psnr_db = 0.0;          // infinite where the pictures are equal
  double differing_share = 0.0;  // of the pixels, 0 to 1
};

// What was drawn instead of the live mesh where it is subdivided past its finest level.
struct FrameSmoothing {
  std::uint64_t faces_before = 0, eligible_faces = 0, faces_after = 0;  // as in SmoothReport
  std::uint32_t depth = 0;                                              // half-steps
  double smooth_ms = 0.0;                                               // 0 where the mesh before served again
  std::string limitation;
};

// Of one frame. What counts up counts from the session's start.
struct FrameRecord {
  std::uint32_t frame = 0;
  double time_s = 0.0;
  bool cut = false;                  // the view jumped since the frame before
  std::uint64_t received_bytes = 0;  // everything on the wire, towards the client
  std::uint64_t segment_bytes = 0;   // of that, refinement
  std::uint64_t segments = 0;
  std::uint64_t splits_applied = 0, splits_undone = 0;  // in this frame
  std::uint64_t triangles = 0;                          // 0: there is no mesh yet
  std::uint64_t issued_vertices = 0;                    // drawn as fans; 0 without pictures
  std::optional<double> error_px;               // stated: at most so far off in what is seen; none without a mesh
  double wanted_tolerance_px = 1.0;             // of the path
  double tolerance_px = 1.0;                    // in force: budgets may have raised it
  std::optional<PictureDifference> difference;  // from the full model's picture; none where none were drawn
  double plan_ms = 0.0, apply_ms = 0.0;
  double draw_ms = 0.0;  // 0 where the picture before served again
  ViewState state = ViewState::progressing;
  std::string reason;             // of a degraded state
  std::uint64_t stale_bytes = 0;  // segments that came after the view had given them up
  std::optional<FrameSmoothing> smoothing = {};
};

inline constexpr std::array<double, 4> kErrorSteps{8.0, 4.0, 2.0, 1.0};  // px

struct Reached {
  double time_s = 0.0;               // since the shot began
  std::uint64_t received_bytes = 0;  // since the shot began
};

// The frames from one cut to the next.
struct Shot {
  std::uint32_t first_frame = 0;
  double start_s = 0.0;
  std::array<std::optional<Reached>, 4> reached;  // by kErrorSteps: the first frame that states at most so much
  std::uint64_t stale_bytes = 0;
  double end_error_px = 0.0;  // stated in its last frame; infinite without a mesh
};

struct SessionSummary {
  std::uint32_t frames = 0;
  double duration_s = 0.0;
  std::optional<double> first_image_s;
  std::uint64_t first_image_bytes = 0;
  std::uint64_t received_bytes = 0, segment_bytes = 0, segments = 0, stale_bytes = 0;
  std::uint64_t splits_applied = 0, splits_undone = 0;
  // Over all frames; drawing over those that were drawn anew.
  double plan_ms_mean = 0.0, apply_ms_mean = 0.0, draw_ms_mean = 0.0;
  double plan_ms_worst = 0.0, apply_ms_worst = 0.0, draw_ms_worst = 0.0;
  // Of frames that were smoothed anew; none without smoothing.
  double smooth_ms_mean = 0.0;
  std::optional<double> smooth_ms_worst;
  std::uint64_t smooth_faces_most = 0;
  double psnr_db_least = 0.0;  // of the frames with a mesh; 0 where no differences were measured
  std::uint32_t degraded_frames = 0;
  std::string degraded_reason;  // the last one
  ViewState end_state = ViewState::progressing;
  std::vector<Shot> shots;  // at least one where there are frames; the first tells times and bytes since the start
  std::optional<PeerDownload> draco;
};

// `first_image_s` and its bytes are taken from the first frame with a mesh, unless the session knows them better.
struct FirstImage {
  double time_s = 0.0;
  std::uint64_t received_bytes = 0;
};
SessionSummary summarise(std::span<const FrameRecord> frames, const std::optional<PeerDownload>& draco,
                         const std::optional<FirstImage>& first_image = {});

// One line a frame under a line of names: the fields of FrameRecord in order, `psnr_db` and `differing_share` for the
// difference, `state` by name; those of `smoothing` only where a frame has it. What there is none of is empty; an
// infinite PSNR is "inf". Numbers with a point, whatever the locale; `reason` is quoted. Lines end in LF.
std::string to_csv(std::span<const FrameRecord> frames);

// What a session was played with, for its report; texts may hold anything.
struct SessionHeader {
  std::string source, model, digest, path;
  std::uint32_t width = 0, height = 0;
  double fps = 0.0;
  bool virtual_time = true;
  std::optional<double> link_mbit_s, round_trip_ms;  // of a simulated link
};

// {"session": header, "summary": ..., "frames": [...]}, names and units as in the structs. What there is none of, and
// what is infinite, is null. Without `frames` only the summary.
std::string to_json(const SessionHeader& header, const SessionSummary& summary, std::span<const FrameRecord> frames);

// The same for people, within 80 columns (texts of the header are cut), each line ended by LF.
std::string to_text(const SessionHeader& header, const SessionSummary& summary);

}  // namespace fanstream
