#include "server/build/patch_replay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "tests/support/asset_helpers.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

// A model simplified to 20 vertices.
struct Merged {
  PositionGrid grid;
  std::vector<GridPoint> codes;
  MergeHistory history;
  CodedHistory coded;
  PlacedMesh placed;

  Merged(const TriangleMesh& mesh, std::uint32_t faces_of_part)
      : grid(PositionGrid::fit(mesh.positions, 12)),
        codes(codes_of(mesh, grid)),
        history(simplified(mesh)),
        coded(history, codes, grid),
        placed(mesh.triangles, codes, grid, faces_of_part) {}

 private:
  static std::vector<GridPoint> codes_of(const TriangleMesh& mesh, const PositionGrid& on) {
    std::vector<GridPoint> result;
    for (const glm::dvec3& p : mesh.positions) result.push_back(on.encode(p));
    return result;
  }
  static MergeHistory simplified(const TriangleMesh& mesh) {
    SimplifyOptions options;
    options.base_vertices = 20;
    return simplify(mesh, options);
  }
};

// The model merged step by step, by looking at all of it every time.
class PlainReplay {
 public:
  PlainReplay(const PlacedMesh& mesh, const CodedHistory& coded)
      : mesh_(mesh), coded_(coded), codes_(mesh.codes), now_(mesh.faces) {
    for (VertexId v = 0; v < codes_.size(); ++v) model_vertex_[mesh.number[v]] = v;
  }

  // By root: the vertices merged into it in this generation, with itself.
  std::map<VertexId, std::set<VertexId>> merge(std::uint32_t generation) {
    const MergeHistory& history = coded_.history;
    std::map<VertexId, std::set<VertexId>> patches;
    for (std::uint32_t m = history.generation_begin[generation]; m < history.generation_begin[generation + 1]; ++m) {
      const MergeRecord& merge = history.merges[m];
      std::set<VertexId>& members = patches[mesh_.number[merge.root]];
      members.insert(mesh_.number[merge.root]);
      members.insert(mesh_.number[merge.removed]);
      codes_[merge.root] = coded_.place_after(m, codes_[merge.root], codes_[merge.removed]);
    }
    before_ = now_;
    for (const auto& [root, members] : patches) {
      for (Triangle& t : now_) {
        for (VertexId& v : t) v = members.contains(v) ? root : v;
      }
    }
    return patches;
  }

  // Whether the face exists; it does as long as its corners are three.
  static bool exists(const Triangle& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; }
  const std::vector<Triangle>& before() const { return before_; }
  const std::vector<Triangle>& now() const { return now_; }
  glm::vec3 place(VertexId number) const { return mesh_.place_of(codes_[model_vertex_.at(number)]); }

 private:
  const PlacedMesh& mesh_;
  const CodedHistory& coded_;
  std::vector<GridPoint> codes_;
  std::map<VertexId, VertexId> model_vertex_;
  std::vector<Triangle> before_, now_;
};

bool touches(const Triangle& t, const std::set<VertexId>& members) {
  return std::any_of(t.begin(), t.end(), [&](VertexId v) { return members.contains(v); });
}

void expect_patch(const PlainReplay& plain, const GenerationStars& stars, std::size_t p, VertexId root,
                  const std::set<VertexId>& members) {
  const auto covered = stars.covered_by(p);
  const std::set<std::uint32_t> covered_set(covered.begin(), covered.end());
  EXPECT_EQ(covered_set.size(), covered.size());
  std::map<std::uint32_t, GenerationStars::StarFace> star;
  for (const GenerationStars::StarFace& f : stars.star_of(p)) star[f.face] = f;
  EXPECT_EQ(star.size(), stars.star_of(p).size());
  for (std::uint32_t f = 0; f < plain.now().size(); ++f) {
    const bool was = PlainReplay::exists(plain.before()[f]);
    ASSERT_EQ(covered_set.contains(f), was && touches(plain.before()[f], members)) << "face " << f;
    const Triangle& t = plain.now()[f];
    const bool left = PlainReplay::exists(t) && touches(t, {root});
    ASSERT_EQ(star.contains(f), left) << "face " << f;
    if (!left) continue;
    const auto at = static_cast<std::size_t>(std::find(t.begin(), t.end(), root) - t.begin());
    EXPECT_EQ(star[f].from, plain.place(t[(at + 1) % 3]) - plain.place(root));
    EXPECT_EQ(star[f].to, plain.place(t[(at + 2) % 3]) - plain.place(root));
  }
  EXPECT_EQ(stars.patches[p].centre, plain.place(root));
  const auto in_order = stars.star_of(p);
  for (std::size_t i = 1; i < in_order.size(); ++i) EXPECT_EQ(in_order[i].from, in_order[i - 1].to);
}

TEST(PatchReplay, TellsWhatEveryPatchCoversAndLeaves) {
  for (const auto& [name, mesh] : testing::model_shapes()) {
    SCOPED_TRACE(name);
    const Merged merged(mesh, 100);
    const MergeHistory& history = merged.history;
    const PlacedMesh& placed = merged.placed;
    PlainReplay plain(placed, merged.coded);
    PatchReplay replay(placed, merged.coded);
    std::uint32_t generation = 0;
    std::uint32_t numbers = 0;
    replay.run(1, [&](const GenerationStars& stars, std::size_t) {
      auto patches = plain.merge(generation++);
      ASSERT_EQ(stars.patches.size(), patches.size());
      EXPECT_EQ(stars.numbers_end, numbers + patches.size());
      for (std::size_t p = 0; p < stars.patches.size(); ++p) {
        const std::uint32_t number = stars.patches[p].number;
        EXPECT_GE(number, numbers);
        EXPECT_LT(number, stars.numbers_end);
        for (std::uint32_t m = history.generation_begin[generation - 1]; m < history.generation_begin[generation];
             ++m) {
          if (replay.patch_of_merge()[m] != number) continue;
          const VertexId root = placed.number[history.merges[m].root];
          ASSERT_TRUE(patches.contains(root)) << "a patch told twice";
          expect_patch(plain, stars, p, root, patches[root]);
          patches.erase(root);
          break;
        }
      }
      EXPECT_TRUE(patches.empty());
      numbers = stars.numbers_end;
    });
    EXPECT_EQ(generation, history.generation_count());
  }
}

// A part that has nothing on a patch's faces need not look at it.
TEST(PatchReplay, PatchesNameThePartsWhoseFacesTheyHoldOrHeld) {
  const Merged merged(testing::make_terrain(40, 40, 3), 200);
  const PlacedMesh& placed = merged.placed;
  ASSERT_EQ(placed.part_count(), 4U);
  std::vector<std::uint8_t> held(placed.faces.size(), 0);  // by face: parts of whatever has ended up on it
  for (std::uint32_t part = 0; part < 4; ++part) {
    for (std::uint32_t f = placed.part_begin(part); f < placed.part_begin(part + 1); ++f)
      held[f] = static_cast<std::uint8_t>(1U << part);
  }
  PatchReplay replay(placed, merged.coded);
  std::size_t spared = 0;
  replay.run(1, [&](const GenerationStars& stars, std::size_t) {
    for (std::size_t p = 0; p < stars.patches.size(); ++p) {
      std::uint8_t parts = 0;
      for (const std::uint32_t f : stars.covered_by(p)) parts |= held[f];
      for (std::uint32_t part = 0; part < 4; ++part) {
        EXPECT_EQ(stars.patches[p].concerns(part), (parts >> part & 1U) != 0);
        spared += stars.patches[p].concerns(part) ? 0 : 1;
      }
      for (const GenerationStars::StarFace& f : stars.star_of(p)) held[f.face] = parts;
    }
  });
  EXPECT_GT(spared, 0U);
}

TEST(PatchReplay, EveryFollowerSeesEveryGenerationInOrder) {
  const Merged merged(testing::make_sphere(150, 160), PlacedMesh::kFacesOfPart);  // enough for threads
  PatchReplay replay(merged.placed, merged.coded);
  std::vector<std::vector<std::uint32_t>> seen(5);
  replay.run(seen.size(), [&](const GenerationStars& stars, std::size_t i) { seen[i].push_back(stars.numbers_end); });
  for (const auto& generations : seen) {
    EXPECT_EQ(generations.size(), merged.history.generation_count());
    EXPECT_EQ(generations, seen[0]);
    EXPECT_TRUE(std::is_sorted(generations.begin(), generations.end()));
  }
}

}  // namespace
}  // namespace fanstream
