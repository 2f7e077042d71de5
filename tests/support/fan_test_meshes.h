// Meshes with known connectivity for the tests of fans and of drawing.
#pragma once

#include <cstdint>

#include "common/mesh/triangle_mesh.h"

namespace fanstream::test {

TriangleMesh make_tetrahedron();
TriangleMesh make_octahedron();

// Every vertex of valence 6; rows and columns at least 3.
TriangleMesh make_torus(std::uint32_t rows, std::uint32_t columns);

// A closed ring of `sides` vertices between two apexes of that valence.
TriangleMesh make_double_cone(std::uint32_t sides);

// A sphere of `vertex_count` >= 4 vertices with valences from 3 to many: vertices inserted into random faces, then
// `flips_per_face` random edge flips a face. Without flips the valences are wild: half are 3, a few in the hundreds.
TriangleMesh make_random_sphere(std::uint32_t vertex_count, std::uint32_t seed, std::uint32_t flips_per_face = 6);

// Removes single faces and whole stars that share no vertex, at random: holes everywhere, yet still a manifold.
TriangleMesh punch_holes(const TriangleMesh& mesh, std::uint32_t seed);

// Both meshes side by side in one, the second moved by `offset`.
TriangleMesh join(TriangleMesh first, const TriangleMesh& second, glm::dvec3 offset);

}  // namespace fanstream::test
