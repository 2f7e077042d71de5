#include "client/render/offscreen_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "client/render/image_difference.h"
#include "common/fans/fan_shape.h"
#include "tests/support/fan_test_meshes.h"

namespace fanstream {
namespace {

FanMesh fan_mesh(const TriangleMesh& mesh) { return *make_fan_mesh(mesh); }

Image render(const FanMesh& mesh, const Camera& camera, const RenderOptions& options = {}) {
  thread_local auto renderer = OffscreenRenderer::create(320, 240);
  EXPECT_TRUE(renderer) << renderer.error().message;
  auto image = renderer->render(mesh, camera, options);
  EXPECT_TRUE(image) << image.error().message;
  return *image;
}

Image background() { return render({}, Camera{}); }

bool is_background(const Image& image, std::uint32_t x, std::uint32_t y) {
  static const Image empty = background();
  return std::equal(image.pixel(x, y), image.pixel(x, y) + 4, empty.pixel(x, y));
}

double brightness(const Image& image, std::uint32_t x, std::uint32_t y) {
  return image.pixel(x, y)[0] + image.pixel(x, y)[1] + image.pixel(x, y)[2];
}

// A square in the plane z = 0, seen head-on from +z.
TriangleMesh make_square() { return {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}}; }
Camera head_on(double z) { return {{0, 0, z}, {0, 0, 0}, {0, 1, 0}, 60.0}; }

TEST(OffscreenRenderer, FansAndTrianglesGiveTheSamePictureToTheLastBit) {
  const std::vector<TriangleMesh> meshes = {
      test::make_torus(40, 25), test::punch_holes(test::make_random_sphere(4000, 7), 1), test::make_double_cone(300),
      test::join(test::make_torus(8, 8), test::make_random_sphere(60, 3), {1, 1, 0})};
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    for (const CoverMethod method : {CoverMethod::paper, CoverMethod::best}) {
      for (const Shading shading : {Shading::smooth, Shading::flat}) {
        SCOPED_TRACE(i);
        const FanMesh mesh = *make_fan_mesh(meshes[i], method);
        const Camera camera = fit(meshes[i].positions);
        const Image fans = render(mesh, camera, {.draw = DrawMode::fans, .shading = shading});
        const Image triangles = render(mesh, camera, {.draw = DrawMode::triangles, .shading = shading});
        EXPECT_EQ(compare_images(fans, triangles)->differing_share, 0.0);
        EXPECT_GT(compare_images(fans, background())->differing_share, 0.1) << "something is drawn";
      }
    }
  }
}

TEST(OffscreenRenderer, PutsTheSurfaceWhereTheCameraSeesIt) {
  const TriangleMesh square = make_square();
  // 60 degrees from 2 * sqrt(3) away: the square's half side is half the picture's half height, 60 pixels.
  const Image image = render(fan_mesh(square), head_on(2.0 * std::sqrt(3.0)));
  for (const auto& [x, y, inside] : std::vector<std::tuple<std::uint32_t, std::uint32_t, bool>>{{160, 120, true},
                                                                                                {102, 62, true},
                                                                                                {217, 177, true},
                                                                                                {97, 120, false},
                                                                                                {222, 120, false},
                                                                                                {160, 57, false},
                                                                                                {160, 182, false}}) {
    EXPECT_EQ(is_background(image, x, y), !inside) << x << ", " << y;
  }
}

TEST(OffscreenRenderer, DrawsUpAsUpAndNearOverFar) {
  TriangleMesh upper = make_square();
  for (glm::dvec3& p : upper.positions) p.y = p.y / 2 + 0.6;
  const Image image = render(fan_mesh(upper), head_on(4));
  EXPECT_FALSE(is_background(image, 160, 90));
  EXPECT_TRUE(is_background(image, 160, 150));

  // Far and near square in either order of drawing: the near one hides the middle of the far one.
  TriangleMesh small = make_square();
  for (glm::dvec3& p : small.positions) p = 0.4 * p + glm::dvec3(0, 0, 0.5);
  for (Triangle& t : small.triangles) std::swap(t[1], t[2]);  // its inside faces the eye, so it is darker
  const Image far_first = render(fan_mesh(test::join(make_square(), small, {0, 0, 0})), head_on(4));
  const Image near_first = render(fan_mesh(test::join(small, make_square(), {0, 0, 0})), head_on(4));
  EXPECT_EQ(compare_images(far_first, near_first)->differing_share, 0.0);
  EXPECT_LT(brightness(far_first, 160, 120), brightness(far_first, 105, 120));
}

TEST(OffscreenRenderer, DrawsWhatLiesInTheDepthOfGivenBounds) {
  const FanMesh square = fan_mesh(make_square());
  const Image whole = render(square, head_on(4));
  RenderOptions options;
  options.depth_bounds = Bounds{{-1, -1, -5}, {1, 1, 1}};
  EXPECT_LT(compare_images(whole, render(square, head_on(4), options))->differing_share, 1e-3);
  options.depth_bounds = Bounds{{-1, -1, -5}, {1, 1, -1}};  // all of the square is nearer
  EXPECT_EQ(compare_images(background(), render(square, head_on(4), options))->differing_share, 0.0);
}

TEST(OffscreenRenderer, LightsBothSidesOfAnOpenSurface) {
  const FanMesh square = fan_mesh(make_square());
  const Image outside = render(square, head_on(4));
  const Image inside = render(square, head_on(-4));
  EXPECT_GT(brightness(outside, 160, 120), brightness(inside, 160, 120));
  EXPECT_GT(brightness(inside, 160, 120), 150.0);
}

TEST(OffscreenRenderer, LooksTheSameWhereverTheModelLies) {
  TriangleMesh mesh = test::make_torus(24, 16);
  for (glm::dvec3& p : mesh.positions) p = glm::dvec3(glm::vec3(p));
  const Image here = render(fan_mesh(mesh), fit(mesh.positions));
  for (const double scale : {1.0 / 1024, 65536.0, 0x1p100}) {
    TriangleMesh moved = mesh;
    for (glm::dvec3& p : moved.positions) p *= scale;
    const Image there = render(fan_mesh(moved), fit(moved.positions));
    EXPECT_GT(compare_images(here, there)->psnr_db, 50.0) << scale;
  }
}

TEST(OffscreenRenderer, SmoothShadingKeepsCreasesAndSmoothsTheRest) {
  const TriangleMesh octahedron = test::make_octahedron();
  const Camera camera = fit(octahedron.positions);
  const FanMesh creased = fan_mesh(octahedron);
  const Image smooth = render(creased, camera);
  EXPECT_EQ(compare_images(smooth, render(creased, camera, {.shading = Shading::flat}))->differing_share, 0.0);
  const FanMesh rounded = *make_fan_mesh(octahedron, CoverMethod::best, {180.0});
  EXPECT_GT(compare_images(smooth, render(rounded, camera))->differing_share, 0.1);
}

TEST(OffscreenRenderer, SmoothsEdges) {
  TriangleMesh tilted = make_square();
  for (glm::dvec3& p : tilted.positions) p = {p.x + 0.1 * p.y, p.y - 0.1 * p.x, 0};
  const Image image = render(fan_mesh(tilted), head_on(4));
  std::size_t between = 0;
  for (std::uint32_t x = 1; x + 1 < image.width; ++x) {
    const double left = brightness(image, x - 1, 120);
    const double right = brightness(image, x + 1, 120);
    const double here = brightness(image, x, 120);
    between += std::abs(left - right) > 60 && here > std::min(left, right) + 10 && here < std::max(left, right) - 10;
  }
  EXPECT_GE(between, 1U);
}

TEST(OffscreenRenderer, RefusesSizesItCannotServe) {
  for (const auto& [width, height, kind] : std::vector<std::tuple<std::uint32_t, std::uint32_t, ErrorKind>>{
           {0, 10, ErrorKind::usage},
           {10, 0, ErrorKind::usage},
           {OffscreenRenderer::kLargestSidePx + 1, 1, ErrorKind::limit},
           {8192, 8192, ErrorKind::limit},
           {0xFFFFFFFFU, 0xFFFFFFFFU, ErrorKind::limit}}) {
    const auto renderer = OffscreenRenderer::create(width, height);
    ASSERT_FALSE(renderer);
    EXPECT_EQ(renderer.error().kind, kind) << renderer.error().message;
  }
  EXPECT_TRUE(OffscreenRenderer::create(1, 1));
  EXPECT_TRUE(OffscreenRenderer::create(OffscreenRenderer::kLargestSidePx, 2));
}

TEST(OffscreenRenderer, RefusesWhatItCannotDrawAndGoesOnAfterwards) {
  auto renderer = OffscreenRenderer::create(64, 48);
  ASSERT_TRUE(renderer);
  const FanMesh good = fan_mesh(make_square());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto refused = [&](auto&& damage, const Camera& camera = head_on(4)) {
    FanMesh bad = good;
    damage(bad);
    const auto image = renderer->render(bad, camera);
    return image ? std::string("drawn") : image.error().message;
  };
  EXPECT_NE(refused([](FanMesh& m) { m.fans[0].center = 4; }).find("fan 0 names vertex 4 of 4"), std::string::npos);
  EXPECT_NE(refused([](FanMesh& m) { m.rings[1] = 0xFFFFFFFF; }).find("fan 0"), std::string::npos);
  EXPECT_NE(refused([](FanMesh& m) { m.fans[0].count = 0xFFFFFFFF; }).find("fan 0"), std::string::npos);
  EXPECT_NE(refused([](FanMesh& m) { m.fans[0].count = 0; }).find("fan 0"), std::string::npos);
  EXPECT_NE(refused([&](FanMesh& m) { m.vertices[2].point.y = nan; }).find("vertex 2"), std::string::npos);
  EXPECT_NE(refused([](FanMesh&) {}, head_on(nan)).find("camera"), std::string::npos);
  EXPECT_EQ(refused([&](FanMesh& m) { m.vertices[2].normal.y = nan; }), "drawn") << "a normal can be done without";
  EXPECT_TRUE(renderer->render(good, head_on(4)));
}

TEST(OffscreenRenderer, ColoursFansAsItIsTold) {
  const TriangleMesh torus = test::make_torus(30, 20);
  const FanMesh mesh = fan_mesh(torus);
  const Camera camera = fit(torus.positions);
  RenderOptions one;
  one.color = {0.9F, 0.2F, 0.1F};
  RenderOptions each;
  each.fan_colors.assign(mesh.fans.size(), one.color);
  EXPECT_EQ(compare_images(render(mesh, camera, one), render(mesh, camera, each))->differing_share, 0.0);
  for (std::size_t i = 0; i < mesh.fans.size(); i += 2) each.fan_colors[i] = {0.1F, 0.2F, 0.9F};
  const Image image = render(mesh, camera, each);
  std::size_t red = 0;
  std::size_t blue = 0;
  for (std::uint32_t y = 0; y < image.height; ++y) {
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const std::uint8_t* p = image.pixel(x, y);
      red += p[0] > 2 * p[2] ? 1 : 0;
      blue += p[2] > 2 * p[0] ? 1 : 0;
    }
  }
  EXPECT_GT(red, 2000U);
  EXPECT_GT(blue, 2000U);
}

TEST(OffscreenRenderer, RefusesColoursThatAreNotOneForEachFan) {
  auto renderer = OffscreenRenderer::create(64, 48);
  ASSERT_TRUE(renderer);
  const FanMesh mesh = fan_mesh(make_square());
  RenderOptions options;
  options.fan_colors.assign(mesh.fans.size() + 1, glm::vec3(1.0F));
  const auto many = renderer->render(mesh, head_on(4), options);
  ASSERT_FALSE(many);
  EXPECT_EQ(many.error().kind, ErrorKind::usage);
  options.fan_colors.resize(mesh.fans.size());
  EXPECT_TRUE(renderer->render(mesh, head_on(4), options));
  options.draw = DrawMode::triangles;
  EXPECT_FALSE(renderer->render(mesh, head_on(4), options));
}

TEST(OffscreenRenderer, SeveralWorkSideBySideInTheirOwnThreads) {
  const FanMesh torus = fan_mesh(test::make_torus(30, 20));
  const Camera camera = fit(Bounds{{-2.8, -2.8, -0.8}, {2.8, 2.8, 0.8}});
  const Image alone = render(torus, camera);
  std::vector<Image> images(3);
  std::vector<std::thread> threads;
  for (Image& image : images) threads.emplace_back([&] { image = render(torus, camera); });
  for (std::thread& thread : threads) thread.join();
  for (const Image& image : images) EXPECT_EQ(compare_images(alone, image)->differing_share, 0.0);
}

}  // namespace
}  // namespace fanstream
