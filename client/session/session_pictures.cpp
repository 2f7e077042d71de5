#include "client/session/session_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "client/render/image_difference.h"

namespace fanstream {
namespace {

constexpr std::size_t kSheetFrames = 12;
constexpr std::uint32_t kSheetWidthPx = 480;
constexpr std::uint32_t kLastFrameMs = 1000;

bool same(const Camera& a, const Camera& b) {
  return a.eye == b.eye && a.target == b.target && a.up == b.up && a.fov_deg == b.fov_deg;
}

// Every factor x factor pixels become their mean.
Image shrunk(const Image& image, std::uint32_t factor) {
  Image small = Image::filled(std::max(1U, image.width / factor), std::max(1U, image.height / factor), {0, 0, 0, 255});
  for (std::uint32_t y = 0; y < small.height; ++y) {
    for (std::uint32_t x = 0; x < small.width; ++x) {
      std::array<std::uint32_t, 4> sum{};
      std::uint32_t count = 0;
      for (std::uint32_t sy = y * factor; sy < std::min((y + 1) * factor, image.height); ++sy) {
        for (std::uint32_t sx = x * factor; sx < std::min((x + 1) * factor, image.width); ++sx, ++count) {
          for (std::size_t c = 0; c < 4; ++c) sum[c] += image.pixel(sx, sy)[c];
        }
      }
      for (std::size_t c = 0; c < 4; ++c) small.pixel(x, y)[c] = static_cast<std::uint8_t>(sum[c] / count);
    }
  }
  return small;
}

std::string bytes_text(std::uint64_t bytes) {
  return bytes < 1'000'000 ? fmt::format("{:.1f} kB", static_cast<double>(bytes) / 1e3)
                           : fmt::format("{:.2f} MB", static_cast<double>(bytes) / 1e6);
}

std::vector<std::string> caption(const FrameRecord& record) {
  std::vector<std::string> lines{fmt::format("{:.2f} s, {}", record.time_s, bytes_text(record.received_bytes))};
  lines.push_back(record.error_px
                      ? fmt::format("{} triangles, at most {:.3g} px off", record.triangles, *record.error_px)
                      : std::string("nothing to show yet"));
  if (record.difference) {
    lines.push_back(std::isfinite(record.difference->psnr_db)
                        ? fmt::format("{:.1f} dB, {:.2g} % of the pixels differ", record.difference->psnr_db,
                                      100.0 * record.difference->differing_share)
                        : std::string("equal to the full model"));
  }
  return lines;
}

std::int64_t milliseconds(double seconds) { return std::llround(seconds * 1e3); }

}  // namespace

SessionPictures::SessionPictures(OffscreenRenderer renderer, std::size_t planned_frames, const FanMesh* full_model,
                                 const std::optional<Bounds>& depth_bounds, std::filesystem::path frame_folder)
    : renderer_(std::move(renderer)),
      planned_frames_(planned_frames),
      full_model_(full_model),
      frame_folder_(std::move(frame_folder)) {
  render_options_.depth_bounds = depth_bounds;
}

Result<SessionPictures> SessionPictures::create(std::uint32_t width, std::uint32_t height, std::size_t planned_frames,
                                                const FanMesh* full_model, const std::optional<Bounds>& depth_bounds,
                                                std::filesystem::path frame_folder) {
  Result<OffscreenRenderer> renderer = OffscreenRenderer::create(width, height);
  if (!renderer) return tl::unexpected(renderer.error());
  return SessionPictures(std::move(*renderer), planned_frames, full_model, depth_bounds, std::move(frame_folder));
}

Result<void> SessionPictures::draw(const FanMesh& mesh, const Camera& camera, FrameRecord& record) {
  const auto start = std::chrono::steady_clock::now();
  Result<Image> image = renderer_.render(mesh, camera, render_options_);
  if (!image) return tl::unexpected(image.error());
  record.draw_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  image_ = std::move(*image);
  difference_.reset();
  if (full_model_ == nullptr) return {};
  if (!camera_ || !same(*camera_, camera) || reference_.rgba.empty()) {
    Result<Image> reference = renderer_.render(*full_model_, camera, render_options_);
    if (!reference) return tl::unexpected(reference.error());
    reference_ = std::move(*reference);
  }
  const Result<ImageDifference> difference = compare_images(image_, reference_);
  if (!difference) return tl::unexpected(difference.error());
  difference_ = PictureDifference{difference->psnr_db, difference->differing_share};
  return {};
}

Result<void> SessionPictures::animate(const Image& image, std::int64_t delay_ms) {
  if (!animation_complete_) return {};
  const auto shown_ms = static_cast<std::uint32_t>(std::clamp<std::int64_t>(delay_ms, 1, AnimatedPng::kLongestDelayMs));
  const Result<void> added = animation_.add(image, shown_ms);
  if (added || added.error().kind != ErrorKind::limit || animation_.frame_count() == 0) return added;
  animation_complete_ = false;
  return {};
}

Result<void> SessionPictures::add(const FanMesh& mesh, bool changed, const Camera& camera, FrameRecord& record) {
  const Image before = image_;
  if (changed || !camera_ || !same(*camera_, camera)) {
    if (const auto drawn = draw(mesh, camera, record); !drawn) return drawn;
  }
  record.difference = difference_;
  // Only now it is known for how long the frame before was seen.
  if (camera_) {
    const std::int64_t shown_ms = milliseconds(record.time_s) - milliseconds(shown_since_s_);
    if (const auto added = animate(before, shown_ms); !added) return added;
  }
  camera_ = camera;
  shown_since_s_ = record.time_s;
  add_to_sheet(record);
  return write_png(image_, frame_folder_ / fmt::format("frame_{:05}.png", record.frame));
}

void SessionPictures::add_to_sheet(const FrameRecord& record) {
  const std::size_t entries = std::min(kSheetFrames, planned_frames_);
  if (sheet_.size() >= entries) return;
  const std::size_t due = entries < 2 ? 0 : sheet_.size() * (planned_frames_ - 1) / (entries - 1);
  if (record.frame < due) return;
  sheet_.push_back({shrunk(image_, (image_.width + kSheetWidthPx - 1) / kSheetWidthPx), caption(record)});
}

Result<AnimatedPng> SessionPictures::animation() {
  if (const auto added = animate(image_, kLastFrameMs); !added) return tl::unexpected(added.error());
  return std::move(animation_);
}

Result<Image> SessionPictures::contact_sheet(const std::string& title) const {
  ContactSheetOptions options;
  options.title = title;
  options.columns = sheet_.size() > 4 ? 4 : 0;
  return make_contact_sheet(sheet_, options);
}

}  // namespace fanstream
