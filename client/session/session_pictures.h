// The pictures of a session: frames, an animation, a contact sheet, and how far each is from the full model's.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "client/render/animated_png.h"
#include "client/render/contact_sheet.h"
#include "client/render/offscreen_renderer.h"
#include "client/session/session_record.h"

namespace fanstream {

// Not thread safe.
class SessionPictures {
 public:
  // `full_model` may be null; `depth_bounds` as in RenderOptions. Frames are written into `frame_folder`. Fails as
  // OffscreenRenderer::create.
  static Result<SessionPictures> create(std::uint32_t width, std::uint32_t height, std::size_t planned_frames,
                                        const FanMesh* full_model, const std::optional<Bounds>& depth_bounds,
                                        std::filesystem::path frame_folder);

  // Draws and writes the frame and fills in `record`'s difference and draw_ms; draw_ms stays 0 where the mesh
  // (`changed` false) and the camera are as in the frame before, whose picture then serves again.
  Result<void> add(const FanMesh& mesh, bool changed, const Camera& camera, FrameRecord& record);

  // Animation and contact sheet of all frames added. Precondition: there is one. The animation, asked for once, ends
  // early where AnimatedPng's limits do.
  Result<AnimatedPng> animation();
  bool animation_complete() const { return animation_complete_; }
  Result<Image> contact_sheet(const std::string& title) const;

 private:
  SessionPictures(OffscreenRenderer renderer, std::size_t planned_frames, const FanMesh* full_model,
                  const std::optional<Bounds>& depth_bounds, std::filesystem::path frame_folder);
  Result<void> animate(const Image& image, std::int64_t delay_ms);
  Result<void> draw(const FanMesh& mesh, const Camera& camera, FrameRecord& record);
  void add_to_sheet(const FrameRecord& record);

  OffscreenRenderer renderer_;
  RenderOptions render_options_;
  std::size_t planned_frames_;
  const FanMesh* full_model_;
  std::filesystem::path frame_folder_;
  std::optional<Camera> camera_;  // of the last frame
  Image image_, reference_;       // of the last frame
  std::optional<PictureDifference> difference_;
  AnimatedPng animation_;
  bool animation_complete_ = true;
  double shown_since_s_ = 0.0;
  std::vector<ContactSheetEntry> sheet_;
};

}  // namespace fanstream
