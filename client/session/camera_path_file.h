// Camera paths as JSON files.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "client/session/camera_path.h"

namespace fanstream {

// {
//   "fps": 25, "size_px": [1024, 768],                    may be left out
//   "keyframes": [
//     {"time_s": 0, "eye": [0, 0, 3], "target": [0, 0, 0],
//      "up": [0, 1, 0], "fov_deg": 35, "tolerance_px": 1,  may be left out: as in the keyframe before, in the first as
//      here "focus": [0.2, 0.1, 0, 0.5],                        x, y, z, radius; null: none; left out: as in the
//      keyframe before "cut": false},                                      true: the view jumps here, see
//      CameraKeyframe
//     ...
//   ]
// }
//
// Errors name the file, the line and the key ("path.json: line 7: keyframes[2].eye: ..."): not_found and io for the
// file, bad_input for what it says (also a key that nobody knows: those known are listed), limit for more than
// kMostPathFileBytes, kMostKeyframes or kMostPathFrames. Safe on untrusted text.
inline constexpr std::size_t kMostPathFileBytes = 8U << 20;
Result<CameraPath> read_camera_path(const std::filesystem::path& file);
Result<CameraPath> parse_camera_path(std::string_view text, const std::string& name);

}  // namespace fanstream
