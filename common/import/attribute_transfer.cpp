#include "common/import/attribute_transfer.h"

#include <cassert>
#include <optional>

namespace fanstream {
namespace {

// The corners of `source` at the places of the corners of `triangle`; nothing where they are not the same three places.
std::optional<Triangle> matched(const TriangleMesh& imported, const Triangle& source, const TriangleMesh& cleaned,
                                const Triangle& triangle) {
  Triangle wedges{};
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3& place = cleaned.positions[triangle[i]];
    std::size_t k = 0;
    while (k < 3 && imported.positions[source[k]] != place) ++k;
    if (k == 3) return std::nullopt;
    wedges[i] = source[k];
  }
  return wedges;
}

}  // namespace

CornerAttributes attributes_after_cleaning(const TriangleMesh& imported, VertexAttributes attributes,
                                           const TriangleMesh& cleaned) {
  CornerAttributes result;
  if (attributes.empty()) return result;
  // Cleaning leaves triangles out and turns them over, but keeps their order; the three corners of one that is kept lie
  // at different places, so that places tell its corners apart.
  result.wedges.reserve(cleaned.triangles.size());
  std::size_t at = 0;
  for (const Triangle& triangle : cleaned.triangles) {
    std::optional<Triangle> wedges;
    while (!wedges && at < imported.triangles.size()) {
      wedges = matched(imported, imported.triangles[at++], cleaned, triangle);
    }
    assert(wedges);
    if (!wedges) return {};
    result.wedges.push_back(*wedges);
  }
  result.values = std::move(attributes);
  return result;
}

}  // namespace fanstream
