// Camera paths made for a model by its bounds alone.
#pragma once

#include <array>
#include <string_view>

#include "client/session/camera_path.h"
#include "common/mesh/triangle_mesh.h"

namespace fanstream {

struct BuiltInPathOptions {
  glm::dvec3 up{0.0, 1.0, 0.0};  // any length above 0; z up is looked at from -y, all else from +z or near it
  double fov_deg = 35.0;         // 1 to 120
  double tolerance_px = 1.0;
  double fps = 25.0;
  std::uint32_t width = 1024;
  std::uint32_t height = 768;
};

inline constexpr std::array<std::string_view, 4> kBuiltInPaths{"orbit", "approach", "fly-by", "jump"};

// Each passes check_path if the options are in its ranges, for all bounds: flat, of one point, anywhere, of any size
// (sizes are taken to be at least 1e-12 of the distance to the origin, coordinates at most 1e90). The eye never enters
// the box.

// Once around the whole model, slightly from above, in 12 s.
CameraPath orbit_path(const Bounds& bounds, const BuiltInPathOptions& options = {});
// Sees the whole model for 2 s, comes within a tenth of its size of its box in 6 s, and stays for 4 s.
CameraPath approach_path(const Bounds& bounds, const BuiltInPathOptions& options = {});
// Along the model's wider side and close to it, from beyond one end to beyond the other, looking a little ahead, in 12
// s.
CameraPath fly_by_path(const Bounds& bounds, const BuiltInPathOptions& options = {});
// Two still close views of opposite sides, 5 s each, with a cut between them.
CameraPath jump_path(const Bounds& bounds, const BuiltInPathOptions& options = {});

// By name; nothing for one that kBuiltInPaths has not.
std::optional<CameraPath> built_in_path(std::string_view name, const Bounds& bounds,
                                        const BuiltInPathOptions& options = {});

}  // namespace fanstream
