// Pictures of levels in which each fan has a colour, as the first source document shows them.
#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "common/fans/fan_mesh.h"
#include "common/support/result.h"

namespace fanstream::bench {

struct FanPicture {
  FanMesh fans;
  std::vector<std::string> caption;
};

// By fan: fans that share an edge differ (where seven colours suffice for taking them one after another, else as many
// as can be do); fans of one triangle are red, whatever is beside them.
std::vector<glm::vec3> color_fans(const FanMesh& mesh);

struct FanSheet {
  std::string title;
  std::vector<FanPicture> pictures;
  std::uint32_t columns = 3;
  glm::dvec3 from{0.5, 0.4, 1.0};  // where the eye stands, seen from the model
};
// All from where the last one is seen whole. Fails as OffscreenRenderer, make_contact_sheet and write_png do.
Result<void> draw_fan_sheet(const FanSheet& sheet, const std::filesystem::path& path);

}  // namespace fanstream::bench
