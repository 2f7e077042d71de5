// What holds for the generations of every history of merges, however they were chosen.
#pragma once

#include <gtest/gtest.h>

#include <set>

#include "server/build/simplifier.h"
#include "tests/support/ring_views.h"

namespace fanstream::testing {

// Merges the mesh as the history tells: each merge is legal and has the wings that the history says, what is left of a
// generation's patches shares no face (no two roots are neighbours, none is absorbed), and the base is what comes out.
inline void expect_disjoint_patches(const TriangleMesh& mesh, const MergeHistory& history) {
  RingMesh rings = RingMesh::from_triangles(mesh.positions.size(), mesh.triangles);
  for (std::uint32_t g = 0; g < history.generation_count(); ++g) {
    std::set<VertexId> roots;
    for (std::uint32_t m = history.generation_begin[g]; m < history.generation_begin[g + 1]; ++m) {
      const MergeRecord& merge = history.merges[m];
      ASSERT_TRUE(rings.can_merge(merge.root, merge.removed)) << "merge " << m;
      const RingMesh::Wings wings = rings.wings(merge.root, merge.removed);
      ASSERT_EQ(wings.first, merge.first);
      ASSERT_EQ(wings.last, merge.last);
      ASSERT_FALSE(roots.contains(merge.removed)) << "a root is absorbed in its own generation, merge " << m;
      rings.merge(merge.root, merge.removed);
      roots.insert(merge.root);
    }
    for (const VertexId root : roots) {
      for (const VertexId w : rings.ring(root)) ASSERT_FALSE(roots.contains(w)) << root << " beside " << w;
    }
  }
  EXPECT_EQ(cycles_of(rings), cycles_of(history.base));
}

}  // namespace fanstream::testing
