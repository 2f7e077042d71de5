// Draws fan meshes into memory with OSMesa (Mesa's software OpenGL): no display, no window system, no GPU.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "client/render/image.h"
#include "client/view/camera.h"
#include "common/fans/fan_mesh.h"

namespace fanstream {

enum class DrawMode {
  fans,       // GL_TRIANGLE_FAN, one glMultiDrawElements for all fans
  triangles,  // GL_TRIANGLES, one glDrawElements
};

enum class Shading {
  // Vertex normals, interpolated; the facet's own at vertices whose normal is zero. With vertex_normals that keeps the
  // edges of CAD models and the facets of coarse levels sharp and scans smooth.
  smooth,
  flat,  // every triangle by its own plane
};

struct RenderOptions {
  DrawMode draw = DrawMode::fans;
  Shading shading = Shading::smooth;
  std::array<glm::vec3, 2> background = {glm::vec3(0.93F, 0.94F, 0.96F),
                                         glm::vec3(0.76F, 0.79F, 0.83F)};  // sRGB, top, bottom
  glm::vec3 color{0.80F, 0.775F, 0.74F};                                   // of the surface, sRGB
  // One colour for each fan instead, to show them; sRGB. For DrawMode::fans, where each run of fans of one colour is
  // drawn by a call of its own.
  std::vector<glm::vec3> fan_colors{};
  // What depth_range() makes of these is drawn; of the mesh's own bounds where there are none.
  std::optional<Bounds> depth_bounds{};
};

// Both modes give the same picture, pixel for pixel. Four samples a pixel. Light comes from the camera's upper left,
// with a fill from the right and a weak headlight; both sides of the surface are lit, the inside a little darker.
//
// Threads: one instance may be used by one thread at a time, any number of instances side by side; Mesa itself uses
// several threads (LP_NUM_THREADS limits them). While a call runs, the instance's context is current on the calling
// thread; after it, none is.
class OffscreenRenderer {
 public:
  static constexpr std::uint32_t kLargestSidePx = 8192;
  static constexpr std::uint64_t kMostPixels = 16'777'216;  // about 0.7 GB while drawing

  // Fails (usage) for a size of zero, (limit) beyond the limits, (unsupported) where Mesa cannot provide OpenGL 3.3.
  static Result<OffscreenRenderer> create(std::uint32_t width, std::uint32_t height);
  OffscreenRenderer(OffscreenRenderer&&) noexcept;
  OffscreenRenderer& operator=(OffscreenRenderer&&) noexcept;
  ~OffscreenRenderer();

  // Fails (usage) for a camera that check_camera refuses and for fan_colors that are not one for each fan or come with
  // DrawMode::triangles, (bad_input) for a fan or an index outside the mesh or a point that is not finite, (limit) for
  // 2^31 indices or more and where memory runs out. An empty mesh gives the background.
  Result<Image> render(const FanMesh& mesh, const Camera& camera, const RenderOptions& options = {});

 private:
  class Implementation;
  explicit OffscreenRenderer(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace fanstream
