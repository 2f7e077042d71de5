// What a frame of local restoration and collision takes, on restored and on full meshes.
#pragma once

#include <span>

#include "tests/bench/papers/collision_scene.h"

namespace fanstream::bench {

// CPU time of one thread, a frame; the least of several rounds at every place.
struct CollisionFigures {
  double us_restored = 0.0;    // moving the focus and colliding with planes, under the tree
  double us_move = 0.0;        // of that, moving the focus
  double us_one_by_one = 0.0;  // moving, and then testing every triangle of the restored mesh
  double us_within = 0.0;      // moving, and colliding with what is in focus alone
  double us_full = 0.0;        // every triangle of the full mesh
  double us_full_tree = 0.0;   // the full mesh under the tree
  double us_ball = 0.0;        // colliding with a mesh at the place of contact, under the tree
  double us_ball_full = 0.0;   // the full mesh likewise
  double mean_triangles = 0.0, mean_original = 0.0, mean_splits = 0.0, mean_contacts = 0.0, mean_tested = 0.0;
  double mean_within = 0.0;                              // contacts in focus
  double mean_ball_tested = 0.0, mean_ball_pairs = 0.0;  // triangles, and pairs that touch
};

// The focus goes along each stretch and back. Getting from one stretch to the next is not counted.
CollisionFigures measure_collision(const CollisionSubject& subject, std::span<const ContactPath> stretches,
                                   std::size_t plane_count, int rounds);

// Contacts with some planes, of a surface or a patch.
template <class Surface>
void collide(const Surface& surface, std::span<const Plane> planes, PlaneContacts& found,
             const FocusTest* within = nullptr) {
  found.clear();
  const PlaneQuery query{.least_distance = false, .within = within};
  for (const Plane& plane : planes) find_contacts(surface, plane, found, query);
}

}  // namespace fanstream::bench
