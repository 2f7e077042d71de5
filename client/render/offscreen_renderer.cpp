#include "client/render/offscreen_renderer.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/osmesa.h>
// After osmesa.h, which brings gl.h.
#include <GL/glext.h>
#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "client/render/draw_list.h"
#include "client/render/shaders.h"

// Mesa 22.3 keeps about 160 bytes of every context for ever; leak checkers shall not blame us for it.
#if defined(__SANITIZE_ADDRESS__)
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa.so\n"; }
#endif

namespace fanstream {
namespace {

constexpr GLsizei kSamples = 4;

Result<GLuint> compile(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint ok = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == GL_TRUE) return shader;
  char log[512] = "";
  glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  glDeleteShader(shader);
  return fail(ErrorKind::unsupported, fmt::format("OpenGL refuses a shader: {}", log));
}

Result<GLuint> link(const char* vertex_source, const char* fragment_source) {
  const auto vertex = compile(GL_VERTEX_SHADER, vertex_source);
  if (!vertex) return vertex;
  const auto fragment = compile(GL_FRAGMENT_SHADER, fragment_source);
  if (!fragment) {
    glDeleteShader(*vertex);
    return fragment;
  }
  const GLuint program = glCreateProgram();
  glAttachShader(program, *vertex);
  glAttachShader(program, *fragment);
  glLinkProgram(program);
  glDeleteShader(*vertex);
  glDeleteShader(*fragment);
  GLint ok = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &ok);
  if (ok == GL_TRUE) return program;
  glDeleteProgram(program);
  return fail(ErrorKind::unsupported, "OpenGL refuses to link a program");
}

void set_uniform(GLuint program, const char* name, const glm::vec3& value) {
  glUniform3fv(glGetUniformLocation(program, name), 1, glm::value_ptr(value));
}

void set_uniform(GLuint program, const char* name, const glm::dmat4& value) {
  const glm::mat4 rounded(value);
  glUniformMatrix4fv(glGetUniformLocation(program, name), 1, GL_FALSE, glm::value_ptr(rounded));
}

// Makes a context current for as long as it lives.
class Current {
 public:
  explicit Current(OSMesaContext context) {
    // Everything is drawn into a framebuffer object; OSMesa only wants a surface to hold on to.
    active_ = OSMesaMakeCurrent(context, surface_.data(), GL_UNSIGNED_BYTE, 8, 8) == GL_TRUE;
  }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;
  ~Current() {
    if (active_) OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0);
  }
  bool active() const { return active_; }

 private:
  std::array<std::uint8_t, 4UL * 8 * 8> surface_{};
  bool active_ = false;
};

Result<void> check_size(std::uint32_t width, std::uint32_t height) {
  if (width == 0 || height == 0) {
    return fail(ErrorKind::usage, fmt::format("a picture of {}x{} pixels has none", width, height));
  }
  if (width > OffscreenRenderer::kLargestSidePx || height > OffscreenRenderer::kLargestSidePx ||
      std::uint64_t{width} * height > OffscreenRenderer::kMostPixels) {
    return fail(ErrorKind::limit,
                fmt::format("{}x{} pixels are too many: at most {} a side and {} in all", width, height,
                            OffscreenRenderer::kLargestSidePx, OffscreenRenderer::kMostPixels));
  }
  return {};
}

}  // namespace

class OffscreenRenderer::Implementation {
 public:
  Implementation(std::uint32_t width, std::uint32_t height) : width_(width), height_(height) {}
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  ~Implementation() {
    if (context_ != nullptr) OSMesaDestroyContext(context_);  // and every object in it
  }

  Result<void> create() {
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              0,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              3,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              3,
                              0};
    context_ = OSMesaCreateContextAttribs(attributes, nullptr);
    const Current current(context_);
    if (context_ == nullptr || !current.active()) {
      return fail(ErrorKind::unsupported, "OSMesa gives no OpenGL 3.3 context; install libosmesa6 of Mesa 20 or later");
    }
    return create_objects();
  }

  Result<Image> render(const DrawList& list, const Camera& camera, const RenderOptions& options) {
    const Current current(context_);
    if (!current.active()) return fail(ErrorKind::limit, "OSMesa could not make its context current: out of memory");
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffers_[0]);
    glViewport(0, 0, static_cast<GLsizei>(width_), static_cast<GLsizei>(height_));
    draw_background(options);
    if (!list.indices.empty()) {
      upload(list);
      draw_surface(list, camera, options);
    }
    Image image = read_back();
    if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
      while (glGetError() != GL_NO_ERROR) {
      }
      return fail(ErrorKind::limit,
                  fmt::format("OpenGL could not draw (error {:#06x}): most likely out of memory", error));
    }
    return image;
  }

 private:
  Result<void> create_objects() {
    const auto surface = link(shaders::kSurfaceVertex, shaders::kSurfaceFragment);
    if (!surface) return tl::unexpected(surface.error());
    const auto background = link(shaders::kBackgroundVertex, shaders::kBackgroundFragment);
    if (!background) return tl::unexpected(background.error());
    surface_program_ = *surface;
    background_program_ = *background;
    glGenVertexArrays(1, &vertex_array_);
    glGenBuffers(2, buffers_.data());
    glBindVertexArray(vertex_array_);
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[0]);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers_[1]);
    const auto attribute = [](GLuint location, std::size_t offset) {
      glEnableVertexAttribArray(location);
      glVertexAttribPointer(location, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), reinterpret_cast<const void*>(offset));
    };
    attribute(0, offsetof(Vertex, point));
    attribute(1, offsetof(Vertex, normal));
    return create_framebuffers();
  }

  // The first has several samples a pixel and depth, the second takes their mean.
  Result<void> create_framebuffers() {
    const auto width = static_cast<GLsizei>(width_);
    const auto height = static_cast<GLsizei>(height_);
    std::array<GLuint, 3> storage{};
    glGenRenderbuffers(3, storage.data());
    glGenFramebuffers(2, framebuffers_.data());
    const auto attach = [&](std::size_t which, GLenum point, GLsizei samples, GLenum format) {
      glBindRenderbuffer(GL_RENDERBUFFER, storage[which]);
      glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
      glFramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, storage[which]);
    };
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffers_[0]);
    attach(0, GL_COLOR_ATTACHMENT0, kSamples, GL_RGBA8);
    attach(1, GL_DEPTH_ATTACHMENT, kSamples, GL_DEPTH_COMPONENT32F);
    bool complete = glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffers_[1]);
    attach(2, GL_COLOR_ATTACHMENT0, 0, GL_RGBA8);
    complete = complete && glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    const GLenum error = glGetError();
    if (!complete || error != GL_NO_ERROR) {
      return fail(error == GL_OUT_OF_MEMORY ? ErrorKind::limit : ErrorKind::unsupported,
                  fmt::format("OpenGL provides no {}x{} framebuffer with {} samples (error {:#06x})", width_, height_,
                              kSamples, error));
    }
    return {};
  }

  void draw_background(const RenderOptions& options) {
    glClear(GL_DEPTH_BUFFER_BIT);
    glDisable(GL_DEPTH_TEST);
    glUseProgram(background_program_);
    set_uniform(background_program_, "top", options.background[0]);
    set_uniform(background_program_, "bottom", options.background[1]);
    // The triangle reads no attributes, but a core profile wants a vertex array, and enabled arrays must be filled.
    const std::array<Vertex, 3> unused{};
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[0]);
    glBufferData(GL_ARRAY_BUFFER, sizeof unused, unused.data(), GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }

  void upload(const DrawList& list) {
    const auto bytes = [](const auto& items) { return static_cast<GLsizeiptr>(items.size() * sizeof(items[0])); };
    glBufferData(GL_ARRAY_BUFFER, bytes(list.vertices), list.vertices.data(), GL_STREAM_DRAW);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, bytes(list.indices), list.indices.data(), GL_STREAM_DRAW);
  }

  void draw_surface(const DrawList& list, const Camera& camera, const RenderOptions& options) {
    Camera placed = camera;
    placed.eye = (camera.eye - list.center) / list.radius;
    placed.target = (camera.target - list.center) / list.radius;
    const Bounds drawn = options.depth_bounds.value_or(list.bounds);
    const Bounds bounds{(drawn.low - list.center) / list.radius, (drawn.high - list.center) / list.radius};
    const double aspect = static_cast<double>(width_) / static_cast<double>(height_);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glUseProgram(surface_program_);
    set_uniform(surface_program_, "view", view_matrix(placed));
    set_uniform(surface_program_, "projection", projection_matrix(placed, aspect, depth_range(placed, bounds)));
    set_uniform(surface_program_, "color", options.color);
    glUniform1f(glGetUniformLocation(surface_program_, "smoothness"), options.shading == Shading::smooth ? 1.0F : 0.0F);
    if (list.fan_sizes.empty()) {
      glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(list.indices.size()), GL_UNSIGNED_INT, nullptr);
      return;
    }
    std::vector<const void*> offsets;
    offsets.reserve(list.fan_offset_bytes.size());
    for (const std::uintptr_t offset : list.fan_offset_bytes) offsets.push_back(reinterpret_cast<const void*>(offset));
    for (std::size_t begin = 0, end = 0; begin < offsets.size(); begin = end) {
      end = end_of_run(options.fan_colors, begin, offsets.size());
      if (!options.fan_colors.empty()) set_uniform(surface_program_, "color", options.fan_colors[begin]);
      glMultiDrawElements(GL_TRIANGLE_FAN, list.fan_sizes.data() + begin, GL_UNSIGNED_INT, offsets.data() + begin,
                          static_cast<GLsizei>(end - begin));
    }
  }

  // Up to where all fans have the colour of the first; all of them where none has a colour of its own.
  static std::size_t end_of_run(const std::vector<glm::vec3>& colors, std::size_t begin, std::size_t count) {
    if (colors.empty()) return count;
    std::size_t end = begin + 1;
    while (end < count && colors[end] == colors[begin]) ++end;
    return end;
  }

  Image read_back() {
    const auto width = static_cast<GLint>(width_);
    const auto height = static_cast<GLint>(height_);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers_[0]);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffers_[1]);
    glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffers_[1]);
    Image image{width_, height_, std::vector<std::uint8_t>(4 * std::size_t{width_} * height_)};
    glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image.rgba.data());
    // OpenGL's rows run upwards.
    const std::size_t row_bytes = 4 * std::size_t{width_};
    for (std::uint32_t y = 0; y < height_ / 2; ++y) {
      std::swap_ranges(image.pixel(0, y), image.pixel(0, y) + row_bytes, image.pixel(0, height_ - 1 - y));
    }
    return image;
  }

  std::uint32_t width_, height_;
  OSMesaContext context_ = nullptr;
  GLuint surface_program_ = 0, background_program_ = 0, vertex_array_ = 0;
  std::array<GLuint, 2> buffers_{};
  std::array<GLuint, 2> framebuffers_{};
};

OffscreenRenderer::OffscreenRenderer(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
OffscreenRenderer::OffscreenRenderer(OffscreenRenderer&&) noexcept = default;
OffscreenRenderer& OffscreenRenderer::operator=(OffscreenRenderer&&) noexcept = default;
OffscreenRenderer::~OffscreenRenderer() = default;

Result<OffscreenRenderer> OffscreenRenderer::create(std::uint32_t width, std::uint32_t height) {
  if (auto sized = check_size(width, height); !sized) return tl::unexpected(sized.error());
  auto implementation = std::make_unique<Implementation>(width, height);
  if (auto created = implementation->create(); !created) return tl::unexpected(created.error());
  return OffscreenRenderer(std::move(implementation));
}

Result<Image> OffscreenRenderer::render(const FanMesh& mesh, const Camera& camera, const RenderOptions& options) {
  if (auto checked = check_camera(camera); !checked) return tl::unexpected(checked.error());
  if (!options.fan_colors.empty() &&
      (options.draw != DrawMode::fans || options.fan_colors.size() != mesh.fans.size())) {
    return fail(ErrorKind::usage,
                fmt::format("{} colours of fans for {} fans{}", options.fan_colors.size(), mesh.fans.size(),
                            options.draw == DrawMode::fans ? "" : " that are drawn as triangles"));
  }
  const auto list = make_draw_list(mesh, options.draw == DrawMode::fans);
  if (!list) return tl::unexpected(list.error());
  return implementation_->render(*list, camera, options);
}

}  // namespace fanstream
