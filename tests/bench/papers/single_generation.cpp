#include "tests/bench/papers/single_generation.h"

#include <algorithm>

#include "common/fans/fan_cover.h"
#include "server/build/merged_ring.h"

namespace fanstream::bench {
namespace {

// Added to the change count of a vertex that is gone: no sum with another's gives a stamp.
constexpr std::uint32_t kGone = 1U << 30U;

}  // namespace

bool SingleGeneration::IsDearer::operator()(const Pair& x, const Pair& y) const {
  if (x.cost != y.cost) return x.cost > y.cost;
  return x.root != y.root ? x.root > y.root : x.removed > y.removed;
}

Result<std::unique_ptr<SingleGeneration>> SingleGeneration::build(const TriangleMesh& mesh,
                                                                  const CostOptions& options) {
  if (const Result<void> checked = check_cost_options(options); !checked) return tl::unexpected(checked.error());
  const Result<FanMesh> fans = cover_with_fans(mesh.positions.size(), mesh.triangles, CoverMethod::paper);
  if (!fans) return tl::unexpected(fans.error());
  std::unique_ptr<SingleGeneration> made(new SingleGeneration(mesh));
  made->take_fans(*fans);
  const std::unique_ptr<MergeCost> cost = make_merge_cost({made->original_, made->rings_, made->places_}, options, 0.0);
  made->merge_all(*cost);
  return made;
}

SingleGeneration::SingleGeneration(const TriangleMesh& mesh)
    : original_(mesh),
      rings_(RingMesh::from_triangles(mesh.positions.size(), mesh.triangles)),
      places_(mesh.positions),
      fan_of_(mesh.positions.size()),
      fan_count_(mesh.positions.size(), 0),
      changes_(mesh.positions.size(), 0) {}

void SingleGeneration::take_fans(const FanMesh& fans) {
  for (const Fan& fan : fans.fans) ++fan_count_[fan.center];
  for (const Fan& fan : fans.fans) {
    const auto ring = fans.ring(fan);
    LooseFan loose{fan.center, {ring.begin(), ring.end()}, fan.closed};
    if (fan_count_[fan.center] == 1) {
      fan_of_[fan.center] = std::move(loose);
    } else {
      others_.push_back(std::move(loose));
    }
  }
}

void SingleGeneration::merge_all(MergeCost& cost) {
  for (VertexId v = 0; v < fan_of_.size(); ++v) {
    for (const VertexId w : rings_.ring(v)) {
      if (v < w && w != kOutside) consider(v, w, cost);
    }
  }
  while (!pairs_.empty()) {
    const Pair pair = pairs_.top();
    pairs_.pop();
    // The wings' own rings may have become too small by other merges.
    if (pair.stamp != changes_[pair.root] + changes_[pair.removed]) continue;
    if (!rings_.can_merge(pair.root, pair.removed)) continue;
    merge(pair);
    cost.merged(pair.root, pair.removed, pair.parent);
    consider_around(pair.root, cost);
  }
}

// Also what is beside the new fan: some costs depend on it.
void SingleGeneration::consider_around(VertexId root, const MergeCost& cost) {
  for (const VertexId w : rings_.ring(root)) {
    if (w != kOutside) ++changes_[w];
  }
  for (const VertexId w : rings_.ring(root)) {
    if (w == kOutside) continue;
    for (const VertexId x : rings_.ring(w)) {
      if (x != kOutside) consider(std::min(w, x), std::max(w, x), cost);
    }
  }
}

std::uint32_t SingleGeneration::faces_around(VertexId v) const {
  return rings_.ring_size(v) - (rings_.is_boundary(v) ? 2 : 0);
}

// A fan's faces are around its centre and no face is in two fans, so to hold all faces around the two centres they need
// only hold as many.
bool SingleGeneration::conditions_hold(VertexId a, VertexId b) const {
  if (fan_count_[a] != 1 || fan_count_[b] != 1) return false;
  if (rings_.position_in_ring(a, b) == rings_.ring_size(a)) return false;
  const RingMesh::Wings wings = rings_.wings(a, b);
  const std::uint32_t shared = (wings.first != kOutside ? 1 : 0) + (wings.last != kOutside ? 1 : 0);
  return fan_of_[a].face_count() + fan_of_[b].face_count() == faces_around(a) + faces_around(b) - shared;
}

void SingleGeneration::consider(VertexId a, VertexId b, const MergeCost& cost) {
  if (!conditions_hold(a, b) || !rings_.can_merge(a, b)) return;
  const MergeProposal proposal = cost.propose(a, b);
  const Pair pair{proposal.cost, a, b, proposal.parent, target_of(a, b, proposal), changes_[a] + changes_[b]};
  if (keeps_faces_upright(pair)) pairs_.push(pair);
}

glm::dvec3 SingleGeneration::target_of(VertexId root, VertexId removed, const MergeProposal& proposal) const {
  switch (proposal.parent) {
    case ParentPosition::kept: return places_[root];
    case ParentPosition::middle: return 0.5 * (places_[root] + places_[removed]);
    case ParentPosition::added: return places_[removed];
    case ParentPosition::free: break;
  }
  return proposal.place;
}

bool SingleGeneration::keeps_faces_upright(const Pair& pair) const {
  MergedRing ring;
  ring.assign(rings_, pair.root, pair.removed);
  ring.assign_places(places_);
  return (pair.parent == ParentPosition::kept || ring.root_may_move(places_[pair.root], pair.target, 0.0)) &&
         (pair.parent == ParentPosition::added || ring.removed_may_move(places_[pair.removed], pair.target, 0.0));
}

void SingleGeneration::merge(const Pair& pair) {
  const VertexId root = pair.root;
  const VertexId removed = pair.removed;
  MergeOfFans made{root,          removed,          rings_.wings(root, removed),
                   places_[root], places_[removed], pair.target,
                   fan_of_[root], fan_of_[removed], {}};
  rings_.merge(root, removed);
  made.of_parent = whole_fan(root);
  places_[root] = made.parent_place;
  fan_of_[root] = made.of_parent;
  fan_count_[removed] = 0;
  ++changes_[root];
  changes_[removed] += kGone;
  merges_.push_back(std::move(made));
}

SingleGeneration::LooseFan SingleGeneration::whole_fan(VertexId center) const {
  const auto around = rings_.ring(center);
  LooseFan fan{center, {around.begin(), around.end()}, true};
  const auto gap = std::find(fan.ring.begin(), fan.ring.end(), kOutside);
  if (gap == fan.ring.end()) return fan;
  std::rotate(fan.ring.begin(), gap, fan.ring.end());
  fan.ring.erase(fan.ring.begin());
  fan.closed = false;
  return fan;
}

void SingleGeneration::go_to(std::size_t level) {
  while (level_ < level) split_once();
  while (level_ > level) merge_once();
}

SingleGeneration::Split SingleGeneration::split_after(std::size_t level) const {
  const MergeOfFans& merge = merges_[merges_.size() - 1 - level];
  return {merge.root, merge.removed};
}

void SingleGeneration::split_once() {
  const MergeOfFans& merge = merges_[merges_.size() - 1 - level_];
  rings_.split(merge.root, merge.removed, rings_.position_in_ring(merge.root, merge.wings.first),
               rings_.position_in_ring(merge.root, merge.wings.last));
  places_[merge.root] = merge.root_place;
  places_[merge.removed] = merge.removed_place;
  fan_of_[merge.root] = merge.of_root;
  fan_of_[merge.removed] = merge.of_removed;
  fan_count_[merge.removed] = 1;
  ++level_;
}

void SingleGeneration::merge_once() {
  const MergeOfFans& merge = merges_[merges_.size() - level_];
  rings_.merge(merge.root, merge.removed);
  places_[merge.root] = merge.parent_place;
  fan_of_[merge.root] = merge.of_parent;
  fan_count_[merge.removed] = 0;
  --level_;
}

std::vector<VertexId> SingleGeneration::vertices() const {
  std::vector<VertexId> vertices;
  for (VertexId v = 0; v < fan_of_.size(); ++v) {
    if (rings_.contains(v)) vertices.push_back(v);
  }
  return vertices;
}

std::vector<VertexId> SingleGeneration::numbers() const {
  std::vector<VertexId> number(fan_of_.size(), 0);
  VertexId next = 0;
  for (VertexId v = 0; v < number.size(); ++v) number[v] = rings_.contains(v) ? next++ : kOutside;
  return number;
}

TriangleMesh SingleGeneration::mesh() const {
  const std::vector<VertexId> number = numbers();
  TriangleMesh mesh;
  for (VertexId v = 0; v < number.size(); ++v) {
    if (number[v] != kOutside) mesh.positions.push_back(places_[v]);
  }
  mesh.triangles = rings_.triangles();
  for (Triangle& t : mesh.triangles) {
    for (VertexId& v : t) v = number[v];
  }
  return mesh;
}

FanMesh SingleGeneration::fans() const {
  const std::vector<VertexId> number = numbers();
  FanMesh mesh;
  for (VertexId v = 0; v < number.size(); ++v) {
    if (number[v] != kOutside) mesh.vertices.push_back({glm::vec3(places_[v]), glm::vec3(0.0F)});
  }
  const auto add = [&](const LooseFan& fan) {
    mesh.fans.push_back({number[fan.center], static_cast<std::uint32_t>(mesh.rings.size()),
                         static_cast<std::uint32_t>(fan.ring.size()), fan.closed});
    for (const VertexId v : fan.ring) mesh.rings.push_back(number[v]);
  };
  for (VertexId v = 0; v < number.size(); ++v) {
    if (fan_count_[v] == 1) add(fan_of_[v]);
  }
  for (const LooseFan& fan : others_) add(fan);
  return mesh;
}

}  // namespace fanstream::bench
