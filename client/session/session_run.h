// Plays a camera path through a session and writes down what was seen and what it took.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "client/session/view_session.h"

namespace fanstream {

struct SessionRunOptions {
  std::filesystem::path folder;  // for all that is written; made where it is missing, its parent must be there
  bool pictures = true;          // false: no frames, no animation, no contact sheet, no comparison
  bool real_time = false;        // frames whose time has passed are left out
  SessionHeader header;
  const FanMesh* full_model = nullptr;   // pictures are compared with its; must outlive the run
  std::optional<Bounds> depth_bounds{};  // RenderOptions': what the session takes its near plane from
  std::optional<PeerDownload> draco;
  std::function<Result<void>()> go_on = {};  // asked before each frame; an error ends the run
  std::function<void(std::string_view stage, double fraction)> progress = {};
};

struct SessionRunReport {
  std::vector<FrameRecord> frames;
  SessionSummary summary;
  std::vector<std::filesystem::path> written;  // the frames' folder as one
  bool animation_complete = true;              // false: it ends where AnimatedPng's limits do
  std::optional<Error> ended_early;  // interrupted, or the session's error: the frames before it are all there
};

// Writes frames/frame_00000.png and so on, animation.png (APNG, frames shown as long as they were seen, the last for a
// second), contact_sheet.png (up to 12 frames), frames.csv, session.json (session_record.h), error_by_bytes.png and
// error_by_time.png (session_plots.h). Files of these names are replaced, frames of an earlier run removed; nothing
// else is touched. What ends the run early, be it a frame that cannot be written, is no failure once there is one: all
// is written about the frames there are. Fails (usage) as check_path, (io) where something cannot be written, with the
// renderer's errors, and with what ended it before the first frame.
Result<SessionRunReport> run_session(ViewSession& session, const CameraPath& path, const SessionRunOptions& options);

}  // namespace fanstream
