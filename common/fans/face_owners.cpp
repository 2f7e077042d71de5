#include "common/fans/face_owners.h"

#include <algorithm>
#include <cassert>

namespace fanstream {
namespace {

// The run of the star that starts at `begin` and has `length` faces becomes a fan.
void append_fan(const VertexStars& stars, VertexId center, std::size_t begin, std::size_t length, FanMesh& mesh) {
  const std::span<const CornerId> star = stars.star(center);
  Fan fan{center, static_cast<std::uint32_t>(mesh.rings.size()), static_cast<std::uint32_t>(length),
          length == star.size() && stars.closed(center)};
  CornerId last = kNone;
  for (std::size_t i = 0; i < length; ++i) {
    last = star[(begin + i) % star.size()];
    mesh.rings.push_back(stars.vertex(next_corner(last)));
  }
  if (fan.closed) {
    const auto ring = mesh.rings.begin() + fan.first;
    std::rotate(ring, std::min_element(ring, mesh.rings.end()), mesh.rings.end());
  } else {
    mesh.rings.push_back(stars.vertex(previous_corner(last)));
    ++fan.count;
  }
  mesh.fans.push_back(fan);
}

void append_fans_at(const VertexStars& stars, const FaceOwners& owners, VertexId center, FanMesh& mesh) {
  const std::span<const CornerId> star = stars.star(center);
  const std::size_t degree = star.size();
  const auto owned = [&](std::size_t i) { return owners[face_of(star[i % degree])] == center; };
  // Start after a gap, so that no run of a closed star is cut where the list happens to begin.
  std::size_t start = 0;
  if (stars.closed(center)) {
    while (start < degree && owned(start)) ++start;
    if (start == degree) return append_fan(stars, center, 0, degree, mesh);
  }
  for (std::size_t i = start; i < start + degree;) {
    std::size_t length = 0;
    while (i + length < start + degree && owned(i + length)) ++length;
    if (length > 0) append_fan(stars, center, i, length, mesh);
    i += length + 1;
  }
}

void append_lone_triangle(Triangle triangle, FanMesh& mesh) {
  std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
  mesh.fans.push_back({triangle[0], static_cast<std::uint32_t>(mesh.rings.size()), 2, false});
  mesh.rings.insert(mesh.rings.end(), {triangle[1], triangle[2]});
}

}  // namespace

FanMesh fans_of(const VertexStars& stars, const FaceOwners& owners) {
  assert(owners.size() == stars.face_count());
  FanMesh mesh;
  mesh.fans.reserve(owners.size() / 5 + 1);
  mesh.rings.reserve(owners.size() + owners.size() / 5 + 2);
  for (VertexId center = 0; center < stars.vertex_count(); ++center) append_fans_at(stars, owners, center, mesh);
  for (FaceId face = 0; face < owners.size(); ++face) {
    if (owners[face] == kNone) append_lone_triangle(stars.triangles()[face], mesh);
  }
  return mesh;
}

std::size_t fan_count(const VertexStars& stars, const FaceOwners& owners) {
  auto count = static_cast<std::size_t>(std::count(owners.begin(), owners.end(), kNone));
  for (VertexId center = 0; center < stars.vertex_count(); ++center) {
    const std::span<const CornerId> star = stars.star(center);
    if (star.empty()) continue;
    const auto owned = [&](CornerId corner) { return owners[face_of(corner)] == center; };
    std::size_t runs = 0;
    bool before = stars.closed(center) && owned(star.back());
    const bool all_around = before;
    bool gap = false;
    for (const CornerId corner : star) {
      const bool now = owned(corner);
      runs += now && !before ? 1 : 0;
      gap = gap || !now;
      before = now;
    }
    count += runs + (all_around && !gap ? 1 : 0);
  }
  return count;
}

}  // namespace fanstream
