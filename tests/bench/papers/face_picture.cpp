#include "tests/bench/papers/face_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

namespace fanstream::bench {
namespace {

constexpr std::uint32_t kPictureScale = 3;

// Places on the picture in samples, with the depth.
std::vector<glm::dvec3> project(const std::vector<glm::dvec3>& places, const View& view, std::uint32_t scale) {
  const Camera& camera = view.camera;
  const glm::dvec3 forward = glm::normalize(camera.target - camera.eye);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.up));
  const glm::dvec3 up = glm::cross(right, forward);
  const double focal = view.height_px * scale / (2 * std::tan(glm::radians(camera.fov_deg) / 2));
  std::vector<glm::dvec3> projected;
  projected.reserve(places.size());
  for (const glm::dvec3& place : places) {
    const glm::dvec3 d = place - camera.eye;
    const double depth = std::max(glm::dot(d, forward), 1e-9);
    projected.emplace_back(view.width_px * scale / 2.0 + focal * glm::dot(d, right) / depth,
                           view.height_px * scale / 2.0 - focal * glm::dot(d, up) / depth, depth);
  }
  return projected;
}

// Calls draw(x, y, depth) for every sample whose centre the triangle covers. 1/depth is linear on the picture.
template <class Draw>
void fill_triangle(const std::array<glm::dvec3, 3>& p, std::uint32_t width, std::uint32_t height, Draw draw) {
  const double area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x);
  if (area == 0 || !std::isfinite(area)) return;
  const auto [low_y, high_y] = std::minmax({p[0].y, p[1].y, p[2].y});
  const int first = static_cast<int>(std::clamp(std::ceil(low_y - 0.5), 0.0, static_cast<double>(height)));
  const int last = static_cast<int>(std::clamp(std::floor(high_y - 0.5), -1.0, height - 1.0));
  for (int y = first; y <= last; ++y) {
    const double cy = y + 0.5;
    double from = std::numeric_limits<double>::infinity();
    double to = -from;
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3& a = p[i];
      const glm::dvec3& b = p[(i + 1) % 3];
      if ((a.y < cy) == (b.y < cy)) continue;
      const double x = a.x + (b.x - a.x) * (cy - a.y) / (b.y - a.y);
      from = std::min(from, x);
      to = std::max(to, x);
    }
    const int left = static_cast<int>(std::clamp(std::ceil(from - 0.5), 0.0, static_cast<double>(width)));
    const int right = static_cast<int>(std::clamp(std::floor(to - 0.5), -1.0, width - 1.0));
    for (int x = left; x <= right; ++x) {
      const double cx = x + 0.5;
      const double w1 = ((cx - p[0].x) * (p[2].y - p[0].y) - (cy - p[0].y) * (p[2].x - p[0].x)) / area;
      const double w2 = ((p[1].x - p[0].x) * (cy - p[0].y) - (p[1].y - p[0].y) * (cx - p[0].x)) / area;
      draw(x, y, 1.0 / ((1 - w1 - w2) / p[0].z + w1 / p[1].z + w2 / p[2].z));
    }
  }
}

class FacePicture {
 public:
  FacePicture(const PolygonMesh& mesh, const View& view)
      : width_(view.width_px * kPictureScale),
        height_(view.height_px * kPictureScale),
        triangles_(triangle_mesh(mesh, &face_of_triangle_)),
        projected_(project(triangles_.positions, view, kPictureScale)),
        eye_(view.camera.eye),
        large_(Image::filled(width_, height_, {250, 250, 252, 255})),
        depth_(std::size_t{width_} * height_, std::numeric_limits<double>::infinity()) {}

  Image run(const PolygonMesh& mesh, const std::vector<std::uint8_t>& depths) {
    for (std::size_t t = 0; t < triangles_.triangles.size(); ++t) {
      const FaceId f = face_of_triangle_[t];
      fill(triangles_.triangles[t], color(mesh, f, depths.empty() ? 0 : depths[f]));
    }
    for (FaceId f = 0; f < mesh.face_count(); ++f) {
      const auto face = mesh.face(f);
      for (std::size_t i = 0; i < face.size(); ++i) draw_edge(face[i], face[(i + 1) % face.size()]);
    }
    return smaller();
  }

 private:
  using Color = std::array<std::uint8_t, 3>;

  Color color(const PolygonMesh& mesh, FaceId f, unsigned depth) const {
    const auto face = mesh.face(f);
    glm::dvec3 normal(0.0);
    const glm::dvec3& origin = triangles_.positions[face[0]];
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      normal += glm::cross(triangles_.positions[face[i]] - origin, triangles_.positions[face[i + 1]] - origin);
    }
    const double length = glm::length(normal) * glm::length(eye_ - origin);
    const double shade = 0.55 + 0.45 * (length > 0 ? std::abs(glm::dot(normal, eye_ - origin)) / length : 1.0);
    constexpr std::array<Color, 5> kTints = {Color{236, 232, 222}, Color{178, 213, 230}, Color{150, 203, 160},
                                             Color{240, 200, 120}, Color{226, 140, 110}};
    Color result = kTints[std::min<std::size_t>(depth / 2, kTints.size() - 1)];
    for (std::uint8_t& channel : result) channel = static_cast<std::uint8_t>(channel * shade);
    return result;
  }

  void fill(const Triangle& triangle, const Color& color) {
    fill_triangle({projected_[triangle[0]], projected_[triangle[1]], projected_[triangle[2]]}, width_, height_,
                  [&](int x, int y, double depth) {
                    double& nearest = depth_[static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x)];
                    if (depth >= nearest) return;
                    nearest = depth;
                    set(x, y, color);
                  });
  }

  void set(int x, int y, const Color& color) {
    std::copy(color.begin(), color.end(), large_.pixel(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)));
  }

  void draw_edge(VertexId from, VertexId to) {
    const glm::dvec3& a = projected_[from];
    const glm::dvec3& b = projected_[to];
    const double steps = std::ceil(std::max({std::abs(b.x - a.x), std::abs(b.y - a.y), 1.0}));
    if (!(steps < 1e5)) return;
    for (double i = 0; i <= steps; ++i) {
      const double t = i / steps;
      const double depth = 1.0 / ((1 - t) / a.z + t / b.z);
      const int x = static_cast<int>(std::floor(a.x + (b.x - a.x) * t));
      const int y = static_cast<int>(std::floor(a.y + (b.y - a.y) * t));
      if (x < 0 || y < 0 || x >= static_cast<int>(width_) || y >= static_cast<int>(height_)) continue;
      const double nearest = depth_[static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x)];
      if (depth <= nearest * 1.004) set(x, y, {45, 50, 62});
    }
  }

  Image smaller() const {
    Image image = Image::filled(width_ / kPictureScale, height_ / kPictureScale, {0, 0, 0, 255});
    for (std::uint32_t y = 0; y < image.height; ++y) {
      for (std::uint32_t x = 0; x < image.width; ++x) {
        for (std::uint32_t channel = 0; channel < 3; ++channel) {
          unsigned sum = 0;
          for (std::uint32_t i = 0; i < kPictureScale * kPictureScale; ++i) {
            sum += large_.pixel(x * kPictureScale + i % kPictureScale, y * kPictureScale + i / kPictureScale)[channel];
          }
          image.pixel(x, y)[channel] = static_cast<std::uint8_t>(sum / (kPictureScale * kPictureScale));
        }
      }
    }
    return image;
  }

  std::uint32_t width_, height_;
  std::vector<FaceId> face_of_triangle_;
  TriangleMesh triangles_;
  std::vector<glm::dvec3> projected_;
  glm::dvec3 eye_;
  Image large_;
  std::vector<double> depth_;
};

// Samples inside with one outside beside them.
std::vector<std::uint8_t> outline(const Coverage& cover) {
  std::vector<std::uint8_t> result(cover.inside.size(), 0);
  for (std::size_t y = 1; y + 1 < cover.height; ++y) {
    for (std::size_t x = 1; x + 1 < cover.width; ++x) {
      const std::size_t i = y * cover.width + x;
      if (cover.inside[i] == 0) continue;
      result[i] = cover.inside[i - 1] == 0 || cover.inside[i + 1] == 0 || cover.inside[i - cover.width] == 0 ||
                  cover.inside[i + cover.width] == 0;
    }
  }
  return result;
}

// The length of a digital curve by its steps: straight ones count 1, diagonal ones the root of 2, as far as the two
// kinds balance (Kulpa's estimate for the number of samples of an 8-connected outline of random direction).
constexpr double kLengthPerSample = 1.111;

}  // namespace

Image draw_faces(const PolygonMesh& mesh, const std::vector<std::uint8_t>& depths, const View& view) {
  return FacePicture(mesh, view).run(mesh, depths);
}

Coverage cover(const PolygonMesh& mesh, const View& view, std::uint32_t scale) {
  Coverage result{view.width_px * scale, view.height_px * scale, scale, {}};
  result.inside.assign(std::size_t{result.width} * result.height, 0);
  const TriangleMesh triangles = triangle_mesh(mesh);
  const std::vector<glm::dvec3> projected = project(triangles.positions, view, scale);
  for (const Triangle& t : triangles.triangles) {
    fill_triangle({projected[t[0]], projected[t[1]], projected[t[2]]}, result.width, result.height,
                  [&](int x, int y, double) {
                    result.inside[static_cast<std::size_t>(y) * result.width + static_cast<std::size_t>(x)] = 1;
                  });
  }
  return result;
}

OutlineError outline_error(const Coverage& drawn, const Coverage& right) {
  const std::vector<std::uint8_t> edge = outline(right);
  const auto length = static_cast<double>(std::count(edge.begin(), edge.end(), 1));
  std::size_t different = 0;
  double worst = 0.0;
  for (std::size_t i = 0; i < drawn.inside.size(); ++i) {
    if (drawn.inside[i] == right.inside[i]) continue;
    ++different;
    const auto x = static_cast<std::int64_t>(i % right.width);
    const auto y = static_cast<std::int64_t>(i / right.width);
    // The nearest sample of the outline, in growing squares around this one.
    double nearest = std::numeric_limits<double>::infinity();
    for (std::int64_t r = 0; static_cast<double>(r) < nearest && r < right.width; ++r) {
      for (std::int64_t dy = -r; dy <= r; ++dy) {
        const std::int64_t step = std::abs(dy) == r ? 1 : std::max<std::int64_t>(2 * r, 1);
        for (std::int64_t dx = -r; dx <= r; dx += step) {
          const std::int64_t px = x + dx;
          const std::int64_t py = y + dy;
          if (px < 0 || py < 0 || px >= right.width || py >= right.height) continue;
          if (edge[static_cast<std::size_t>(py) * right.width + static_cast<std::size_t>(px)] == 0) continue;
          nearest = std::min(nearest, std::hypot(static_cast<double>(dx), static_cast<double>(dy)));
        }
      }
    }
    if (std::isfinite(nearest)) worst = std::max(worst, nearest);
  }
  if (length == 0) return {};
  const double scale = right.scale;
  return {static_cast<double>(different) / (kLengthPerSample * length * scale), worst / scale};
}

}  // namespace fanstream::bench
