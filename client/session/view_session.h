// What plays a camera path needs to know of a model that is being received for the view: one step a frame, and a mesh
// to draw.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "client/session/camera_path.h"
#include "client/session/session_record.h"
#include "client/session/virtual_link.h"
#include "client/smooth/smooth_silhouette.h"
#include "common/fans/fan_mesh.h"
#include "common/mesh/triangle_mesh.h"

namespace fanstream {

// What one step did and how things stand after it; fields as in FrameRecord.
struct SessionStep {
  double time_s = 0.0;  // on the session's clock
  std::uint64_t received_bytes = 0;
  std::uint64_t segment_bytes = 0;
  std::uint64_t segments = 0;
  std::uint64_t splits_applied = 0, splits_undone = 0;  // in this step
  std::uint64_t triangles = 0;                          // 0 before FM0
  std::optional<double> error_px;
  double tolerance_px = 1.0;
  double plan_ms = 0.0, apply_ms = 0.0;
  ViewState state = ViewState::progressing;
  std::string reason;
  std::uint64_t stale_bytes = 0;
};

// Not thread safe. The clock starts at 0 before the connection is made.
class ViewSession {
 public:
  virtual ~ViewSession() = default;

  // Goes on to time_s, receiving what comes until then for the view of the last step, and turns to this view: plans,
  // asks, applies. So what a view needs is asked for when it is seen, not before. In virtual
  // time the clock then stands at time_s, in real time it may be later. Times never go back. A server that stalls or is
  // gone is a degraded state as long as there is something to show; an error ends the session, whose mesh stays.
  virtual Result<SessionStep> step(const PathView& view, double time_s) = 0;
  virtual double now_s() const = 0;

  // The mesh as it is, to be drawn; empty before FM0 has come.
  virtual Result<FanMesh> fan_mesh() = 0;
  // Whether fan_mesh() changes with the camera alone, and what smoothing did for the last one, if it is on.
  virtual bool mesh_follows_camera() const { return false; }
  virtual std::optional<SmoothReport> smoothing() const { return {}; }
  // When FM0 could be drawn, and after how many bytes: more exactly than frames tell. Nothing before.
  virtual std::optional<FirstImage> first_image() const = 0;
};

struct SessionSettings {
  std::string source;                        // HOST:PORT/MODEL or an asset file
  std::uint32_t width = 1024, height = 768;  // of the picture that errors are stated for
  bool real_time = false;
  VirtualLinkOptions link;  // in virtual time
  std::optional<std::uint64_t> triangle_budget, memory_budget_bytes;
  std::optional<SmoothOptions> smooth;  // meshes to draw are subdivided past the finest level
  std::optional<std::filesystem::path> cache_folder;
  bool whole_model = true;  // the model is wanted in OpenedSession::full too
  const std::atomic<bool>* stop = nullptr;
  std::function<void(std::string_view stage, double fraction)> progress = {};
  // Told, in a sentence, what people want to know while they wait: connections lost and found, a cache given up.
  std::function<void(const std::string&)> on_notice = {};
};

struct OpenedSession {
  std::unique_ptr<ViewSession> session;
  std::string model, digest;
  Bounds bounds;                       // of the model, to make built-in paths by
  std::optional<TriangleMesh> full{};  // the whole model, to compare with; its positions lie on a grid of:
  double grid_step = 0.0;
};
using SessionOpener = std::function<Result<OpenedSession>(const SessionSettings&)>;

}  // namespace fanstream
