// Small manifolds of all kinds, with boundary and without, by name.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tests/support/fan_test_meshes.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/ring_views.h"

namespace fanstream::testing {

inline std::vector<std::pair<std::string, TriangleMesh>> fan_shapes() {
  std::vector<std::pair<std::string, TriangleMesh>> all;
  all.emplace_back("tetrahedron", make_tetrahedron());
  all.emplace_back("octahedron", test::make_octahedron());
  all.emplace_back("sphere with poles of valence 12", make_sphere(7, 12));
  all.emplace_back("sphere of wild valences", test::make_random_sphere(120, 5, 0));
  all.emplace_back("double cone of valence 90", test::make_double_cone(90));
  all.emplace_back("torus", make_torus(9, 7));
  all.emplace_back("terrain", make_terrain(8, 7, 3));
  all.emplace_back("cylinder", make_open_cylinder(8, 4));
  all.emplace_back("cylinder of one row", make_open_cylinder(6, 1));
  all.emplace_back("sphere with holes", without_unused(test::punch_holes(test::make_random_sphere(150, 2), 9)));
  TriangleMesh several = make_torus(5, 5);
  append(several, make_grid(3, 3), {5, 0, 0});
  append(several, make_tetrahedron(), {9, 0, 0});
  append(several, make_grid(1, 1), {12, 0, 0});
  all.emplace_back("components", several);
  all.emplace_back("triangle", TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  return all;
}

}  // namespace fanstream::testing
