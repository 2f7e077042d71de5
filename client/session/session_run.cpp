#include "client/session/session_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "client/session/session_pictures.h"
#include "client/session/session_plots.h"
#include "common/fans/fan_cover.h"
#include "common/support/atomic_file.h"

namespace fanstream {
namespace {

namespace fs = std::filesystem;

Result<void> make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directory(folder, error);
  if (error || !fs::is_directory(folder)) {
    const std::string reason = error ? error.message() : "there is a file of that name";
    return fail(ErrorKind::io, fmt::format("{}: cannot be made a folder: {}", folder.string(), reason));
  }
  return {};
}

// "frame_00012.png" and nothing else: frames of an earlier run.
bool is_frame_name(const std::string& name) {
  constexpr std::string_view kDigits = "0123456789";
  return name.size() >= 15 && name.compare(0, 6, "frame_") == 0 && name.compare(name.size() - 4, 4, ".png") == 0 &&
         name.find_first_not_of(kDigits, 6) == name.size() - 4;
}

Result<void> remove_old_frames(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> old;
  for (fs::directory_iterator file(folder, error), end; !error && file != end; file.increment(error)) {
    if (is_frame_name(file->path().filename().string())) old.push_back(file->path());
  }
  for (const fs::path& path : old) {
    if (!error) fs::remove(path, error);
  }
  if (error) return fail(ErrorKind::io, fmt::format("{}: {}", folder.string(), error.message()));
  return {};
}

Result<void> write_text(const fs::path& path, const std::string& text) {
  return write_file_atomically(path, std::as_bytes(std::span(text)));
}

FrameRecord record_of(const SessionStep& step, std::size_t frame, const PathView& view, bool cut) {
  FrameRecord record;
  record.frame = static_cast<std::uint32_t>(frame);
  record.time_s = step.time_s;
  record.cut = cut;
  record.received_bytes = step.received_bytes;
  record.segment_bytes = step.segment_bytes;
  record.segments = step.segments;
  record.splits_applied = step.splits_applied;
  record.splits_undone = step.splits_undone;
  record.triangles = step.triangles;
  record.error_px = step.error_px;
  record.wanted_tolerance_px = view.tolerance_px;
  record.tolerance_px = step.tolerance_px;
  record.plan_ms = step.plan_ms;
  record.apply_ms = step.apply_ms;
  record.state = step.state;
  record.reason = step.reason;
  record.stale_bytes = step.stale_bytes;
  return record;
}

std::optional<FrameSmoothing> smoothing_of(const std::optional<SmoothReport>& report) {
  if (!report) return {};
  return FrameSmoothing{report->faces_before, report->eligible_faces,   report->faces_after,
                        report->depth,        report->seconds * 1000.0, report->limitation};
}

class SessionRun {
 public:
  SessionRun(ViewSession& session, const CameraPath& path, const SessionRunOptions& options)
      : session_(session), path_(path), options_(options) {}

  Result<SessionRunReport> run() {
    if (auto checked = check_path(path_); !checked) return tl::unexpected(checked.error());
    if (auto ready = prepare(); !ready) return tl::unexpected(ready.error());
    play();
    if (report_.frames.empty()) return tl::unexpected(*report_.ended_early);
    report_.summary = summarise(report_.frames, options_.draco, session_.first_image());
    tell("writing", 1.0);
    if (auto written = write_reports(); !written) return tl::unexpected(written.error());
    return std::move(report_);
  }

 private:
  void tell(std::string_view stage, double fraction) const {
    if (options_.progress) options_.progress(stage, fraction);
  }

  Result<void> prepare() {
    if (auto made = make_folder(options_.folder); !made) return made;
    if (!options_.pictures) return {};
    const fs::path frames = options_.folder / "frames";
    if (auto made = make_folder(frames); !made) return made;
    if (auto removed = remove_old_frames(frames); !removed) return removed;
    Result<SessionPictures> pictures = SessionPictures::create(path_.width, path_.height, frame_count(path_),
                                                               options_.full_model, options_.depth_bounds, frames);
    if (!pictures) return tl::unexpected(pictures.error());
    pictures_.emplace(std::move(*pictures));
    return {};
  }

  // What ends it is kept in the report.
  void play() {
    const std::size_t count = frame_count(path_);
    double last_s = -1.0;
    for (std::size_t frame = 0; frame < count; frame = next_frame(frame)) {
      tell("playing", static_cast<double>(frame) / static_cast<double>(count));
      const double time_s = frame_time_s(path_, frame);
      const PathView view = view_at(path_, time_s);
      const Result<SessionStep> step = next_step(view, time_s);
      if (!step) {
        report_.ended_early = step.error();
        return;
      }
      FrameRecord record = record_of(*step, frame, view, frame > 0 && has_cut(path_, last_s, time_s));
      last_s = time_s;
      if (auto drawn = draw(view.camera, record); !drawn) {
        report_.ended_early = drawn.error();
        return;
      }
      report_.frames.push_back(std::move(record));
    }
  }

  Result<SessionStep> next_step(const PathView& view, double time_s) {
    if (options_.go_on) {
      if (const Result<void> going = options_.go_on(); !going) return tl::unexpected(going.error());
    }
    return session_.step(view, time_s);
  }

  std::size_t next_frame(std::size_t frame) const {
    if (!options_.real_time) return frame + 1;
    const double due = std::ceil(session_.now_s() * path_.fps - 1e-6);
    return std::max(frame + 1, static_cast<std::size_t>(std::clamp(due, 0.0, 1e9)));
  }

  Result<void> draw(const Camera& camera, FrameRecord& record) {
    if (!pictures_) return {};
    const bool changed = report_.frames.empty() || record.splits_applied + record.splits_undone > 0 ||
                         record.triangles != report_.frames.back().triangles || smoothing_changes(camera, record);
    camera_ = camera;
    if (changed) {
      Result<FanMesh> mesh = session_.fan_mesh();
      if (!mesh) return tl::unexpected(mesh.error());
      mesh_ = std::move(*mesh);
      issued_vertices_ = fan_statistics(mesh_.vertices.size(), mesh_).issued_vertices;
    }
    record.issued_vertices = issued_vertices_;
    record.smoothing = smoothing_of(session_.smoothing());
    if (record.smoothing && !changed) record.smoothing->smooth_ms = 0.0;
    return pictures_->add(mesh_, changed, camera, record);
  }

  // What is smoothed is so for one camera; and segments may tell of faces that were not known.
  bool smoothing_changes(const Camera& camera, const FrameRecord& record) const {
    if (!session_.mesh_follows_camera()) return false;
    const View now{camera, path_.width, path_.height, 0.0};
    return !(now == View{camera_, path_.width, path_.height, 0.0}) || record.segments != report_.frames.back().segments;
  }

  Result<void> keep(const char* file, const std::function<Result<void>(const fs::path&)>& write) {
    const fs::path path = options_.folder / file;
    if (auto written = write(path); !written) return written;
    report_.written.push_back(path);
    return {};
  }

  static Result<void> write_image(const Result<Image>& image, const fs::path& path) {
    if (!image) return tl::unexpected(image.error());
    return write_png(*image, path);
  }

  // The tables first: if the disk fills up, better without pictures than without numbers.
  Result<void> write_reports() {
    const std::string title = fmt::format("{}, {}", options_.header.model, options_.header.path);
    Result<void> written = keep("frames.csv", [&](const fs::path& p) { return write_text(p, to_csv(report_.frames)); });
    if (written) {
      written = keep("session.json", [&](const fs::path& p) {
        return write_text(p, to_json(options_.header, report_.summary, report_.frames));
      });
    }
    if (written) {
      written = keep("error_by_bytes.png", [&](const fs::path& p) {
        return write_image(plot_error_by_bytes(title, report_.frames, options_.draco), p);
      });
    }
    if (written) {
      written = keep("error_by_time.png", [&](const fs::path& p) {
        return write_image(plot_error_by_time(title, report_.frames, options_.draco), p);
      });
    }
    if (!written || !pictures_) return written;
    report_.written.push_back(options_.folder / "frames");
    written =
        keep("contact_sheet.png", [&](const fs::path& p) { return write_image(pictures_->contact_sheet(title), p); });
    if (!written) return written;
    return keep("animation.png", [&](const fs::path& p) -> Result<void> {
      const Result<AnimatedPng> animation = pictures_->animation();
      if (!animation) return tl::unexpected(animation.error());
      report_.animation_complete = pictures_->animation_complete();
      return animation->write(p);
    });
  }

  ViewSession& session_;
  const CameraPath& path_;
  const SessionRunOptions& options_;
  std::optional<SessionPictures> pictures_;
  FanMesh mesh_;
  Camera camera_;                      // of the last frame
  std::uint64_t issued_vertices_ = 0;  // of mesh_
  SessionRunReport report_;
};

}  // namespace

Result<SessionRunReport> run_session(ViewSession& session, const CameraPath& path, const SessionRunOptions& options) {
  return SessionRun(session, path, options).run();
}

}  // namespace fanstream
