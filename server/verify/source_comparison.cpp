#include "server/verify/source_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace fanstream {
namespace {

constexpr std::size_t kDifferencesNamed = 3;

using Code = std::array<std::int32_t, 3>;
using Face = std::array<Code, 3>;

Code code_of(const PositionGrid& grid, const glm::dvec3& position) {
  const GridPoint code = grid.encode(position);
  return {code.x, code.y, code.z};
}

std::vector<Code> sorted_codes(const TriangleMesh& mesh, const PositionGrid& grid) {
  std::vector<Code> codes;
  codes.reserve(mesh.positions.size());
  for (const glm::dvec3& position : mesh.positions) codes.push_back(code_of(grid, position));
  std::sort(codes.begin(), codes.end());
  return codes;
}

// The least of a face's three rotations: the same for the same oriented face, also where corners coincide.
Face canonical(const Face& face) {
  return std::min({face, Face{face[1], face[2], face[0]}, Face{face[2], face[0], face[1]}});
}

std::vector<Face> sorted_faces(const TriangleMesh& mesh, const PositionGrid& grid) {
  std::vector<Face> faces;
  faces.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    faces.push_back(canonical({code_of(grid, mesh.positions[t[0]]), code_of(grid, mesh.positions[t[1]]),
                               code_of(grid, mesh.positions[t[2]])}));
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

std::string text_of(const Code& code) { return fmt::format("({} {} {})", code[0], code[1], code[2]); }
std::string text_of(const Face& face) { return text_of(face[0]) + text_of(face[1]) + text_of(face[2]); }

// Encoding clamps to the grid, so an input that leaves it would pass unseen.
Result<void> check_on_grid(const TriangleMesh& input, const PositionGrid& grid, const std::string& input_name) {
  const double most = grid.step() * 0.5 * (1.0 + 1e-6);
  for (std::size_t v = 0; v < input.positions.size(); ++v) {
    const glm::dvec3 off = grid.decode(grid.encode(input.positions[v])) - input.positions[v];
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(off[axis]) <= most) continue;
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: vertex {} of the cleaned mesh lies {:.4g} grid steps off the asset's grid on "
                              "axis {}; the asset is of another model",
                              input_name, v, std::abs(off[axis]) / grid.step(), "xyz"[axis]));
    }
  }
  return {};
}

// The first few that only one of two sorted multisets has.
template <class Item>
std::string differences(const std::vector<Item>& asset, const std::vector<Item>& input) {
  std::vector<Item> only_asset;
  std::vector<Item> only_input;
  std::set_difference(asset.begin(), asset.end(), input.begin(), input.end(), std::back_inserter(only_asset));
  std::set_difference(input.begin(), input.end(), asset.begin(), asset.end(), std::back_inserter(only_input));
  std::string text;
  const auto add = [&](const std::vector<Item>& items, const char* where) {
    if (items.empty()) return;
    text += fmt::format("{}{} only in {}:", text.empty() ? "" : "; ", items.size(), where);
    for (std::size_t i = 0; i < std::min(items.size(), kDifferencesNamed); ++i)
      text.append(1, ' ').append(text_of(items[i]));
    if (items.size() > kDifferencesNamed) text += " ...";
  };
  add(only_asset, "the asset");
  add(only_input, "the input");
  return text;
}

}  // namespace

Result<std::string> compare_with_source(const TriangleMesh& full, const PositionGrid& grid,
                                        const TriangleMesh& cleaned_input, const std::string& asset_name,
                                        const std::string& input_name) {
  if (Result<void> on_grid = check_on_grid(cleaned_input, grid, input_name); !on_grid)
    return tl::unexpected(on_grid.error());
  const auto differ = [&](const std::string& what) {
    return fail(ErrorKind::bad_input, asset_name + " is not " + input_name + ": " + what + " (points of the grid)");
  };
  {
    const std::vector<Face> asset_faces = sorted_faces(full, grid);
    const std::vector<Face> input_faces = sorted_faces(cleaned_input, grid);
    if (asset_faces != input_faces) return differ("faces differ: " + differences(asset_faces, input_faces));
  }
  const std::vector<Code> asset_points = sorted_codes(full, grid);
  const std::vector<Code> input_points = sorted_codes(cleaned_input, grid);
  if (asset_points != input_points) return differ("vertices differ: " + differences(asset_points, input_points));
  return fmt::format("equals the cleaned, quantised input: {} faces", full.triangles.size());
}

}  // namespace fanstream
