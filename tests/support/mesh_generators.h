// Small meshes of known shape and topology for tests. Everything is deterministic: random shapes depend on their seed
// alone. Unless said otherwise a mesh is an oriented 2-manifold, outward facing, with every vertex used.
#pragma once

#include <cstdint>

#include "common/mesh/triangle_mesh.h"

namespace fanstream::testing {

// Closed surfaces.
TriangleMesh make_tetrahedron();
// A latitude-longitude sphere with two poles: (rows - 1) * columns + 2 vertices, 2 * (rows - 1) * columns triangles.
// rows >= 2, columns >= 3.
TriangleMesh make_sphere(unsigned rows, unsigned columns, double radius = 1.0);
// Genus 1: rings * sides vertices, twice as many triangles. rings, sides >= 3.
TriangleMesh make_torus(unsigned rings, unsigned sides, double major_radius = 1.0, double minor_radius = 0.35);

// Surfaces with boundary.
// A flat unit-spaced grid of columns x rows quads in the xy plane facing +z: (columns + 1) * (rows + 1) vertices.
TriangleMesh make_grid(unsigned columns, unsigned rows);
// The same grid with smooth hills plus a little seeded noise as heights.
TriangleMesh make_terrain(unsigned columns, unsigned rows, std::uint64_t seed);
// A cylinder without caps: two boundary loops. sides >= 3, rows >= 1.
TriangleMesh make_open_cylinder(unsigned sides, unsigned rows, double radius = 1.0, double height = 2.0);

// Not oriented manifolds: input for the cleaner.
// `pages` rectangles (two triangles each) that all share one edge: non-manifold for three pages or more.
TriangleMesh make_book(unsigned pages);
// A closed strip of `segments` quads with a half twist: manifold, but not orientable. segments >= 3.
TriangleMesh make_moebius(unsigned segments);
// Two triangle fans of `fan_faces` faces each that touch in one vertex only.
TriangleMesh make_bowtie(unsigned fan_faces);
// `triangle_count` triangles with corners drawn at random from `vertex_count` random positions in the unit cube;
// corners may repeat, triangles may repeat. With duplicate_positions, about a quarter of the positions are copies of
// others.
TriangleMesh make_random_soup(unsigned vertex_count, unsigned triangle_count, std::uint64_t seed,
                              bool duplicate_positions = false);

// Every triangle with three vertices of its own, as an STL file stores it.
TriangleMesh explode(const TriangleMesh& mesh);
// `other` moved by `offset` and added to `mesh` as further components.
void append(TriangleMesh& mesh, const TriangleMesh& other, const glm::dvec3& offset);
// The mesh with vertices and triangles in random order and every triangle rotated at random; winding is kept.
TriangleMesh shuffled(const TriangleMesh& mesh, std::uint64_t seed);

}  // namespace fanstream::testing
