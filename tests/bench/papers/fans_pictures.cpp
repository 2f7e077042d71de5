#include "tests/bench/papers/fans_pictures.h"

#include <algorithm>
#include <array>
#include <map>

#include "client/render/contact_sheet.h"
#include "client/render/offscreen_renderer.h"

namespace fanstream::bench {
namespace {

constexpr std::array<glm::vec3, 7> kColors{glm::vec3(0.56F, 0.74F, 0.93F), glm::vec3(0.98F, 0.80F, 0.47F),
                                           glm::vec3(0.60F, 0.84F, 0.58F), glm::vec3(0.80F, 0.68F, 0.90F),
                                           glm::vec3(0.95F, 0.93F, 0.86F), glm::vec3(0.45F, 0.78F, 0.78F),
                                           glm::vec3(0.93F, 0.66F, 0.72F)};
constexpr glm::vec3 kLoneTriangle{0.80F, 0.12F, 0.10F};
constexpr std::size_t kNoColor = kColors.size();

// By fan, those across an edge.
std::vector<std::vector<std::size_t>> neighbours_of(const FanMesh& mesh) {
  std::map<std::array<VertexId, 2>, std::size_t> fan_at;  // by directed edge
  for (std::size_t i = 0; i < mesh.fans.size(); ++i) {
    const auto ring = mesh.ring(mesh.fans[i]);
    for (std::size_t k = 0; k < mesh.fans[i].face_count(); ++k) {
      const VertexId corners[] = {mesh.fans[i].center, ring[k], ring[(k + 1) % ring.size()]};
      for (std::size_t c = 0; c < 3; ++c) fan_at[{corners[c], corners[(c + 1) % 3]}] = i;
    }
  }
  std::vector<std::vector<std::size_t>> neighbours(mesh.fans.size());
  for (const auto& [edge, fan] : fan_at) {
    const auto across = fan_at.find({edge[1], edge[0]});
    if (across != fan_at.end() && across->second != fan) neighbours[fan].push_back(across->second);
  }
  return neighbours;
}

}  // namespace

std::vector<glm::vec3> color_fans(const FanMesh& mesh) {
  const std::vector<std::vector<std::size_t>> neighbours = neighbours_of(mesh);
  std::vector<std::size_t> chosen(mesh.fans.size(), kNoColor);
  std::vector<glm::vec3> colors(mesh.fans.size(), kLoneTriangle);
  for (std::size_t i = 0; i < mesh.fans.size(); ++i) {
    if (mesh.fans[i].face_count() == 1) continue;
    std::array<std::size_t, kColors.size() + 1> uses{};
    for (const std::size_t other : neighbours[i]) ++uses[chosen[other]];
    // Starting elsewhere each time, so that all colours come up equally often.
    std::size_t best = i % kColors.size();
    for (std::size_t k = 1; k < kColors.size(); ++k) {
      const std::size_t color = (i + k) % kColors.size();
      if (uses[color] < uses[best]) best = color;
    }
    chosen[i] = best;
    colors[i] = kColors[best];
  }
  return colors;
}

Result<void> draw_fan_sheet(const FanSheet& sheet, const std::filesystem::path& path) {
  constexpr std::uint32_t kWidth = 560;
  constexpr std::uint32_t kHeight = 520;
  Result<OffscreenRenderer> renderer = OffscreenRenderer::create(kWidth, kHeight);
  if (!renderer) return tl::unexpected(renderer.error());
  std::vector<glm::dvec3> points;
  for (const Vertex& v : sheet.pictures.back().fans.vertices) points.emplace_back(v.point);
  FitOptions fitting;
  fitting.from = sheet.from;
  fitting.aspect = static_cast<double>(kWidth) / kHeight;
  const Camera camera = fit(points, fitting);
  std::vector<ContactSheetEntry> entries;
  for (const FanPicture& picture : sheet.pictures) {
    RenderOptions look;
    look.shading = Shading::flat;
    look.fan_colors = color_fans(picture.fans);
    Result<Image> image = renderer->render(picture.fans, camera, look);
    if (!image) return tl::unexpected(image.error());
    entries.push_back({std::move(*image), picture.caption});
  }
  ContactSheetOptions options;
  options.title = sheet.title;
  options.columns = sheet.columns;
  const Result<Image> drawn = make_contact_sheet(entries, options);
  if (!drawn) return tl::unexpected(drawn.error());
  return write_png(*drawn, path);
}

}  // namespace fanstream::bench
