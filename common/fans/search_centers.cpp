#include <algorithm>
#include <cstdint>

#include "common/fans/cover_search.h"

namespace fanstream {
namespace {

// Row weighting local search (Gao, Weise, Li: "An efficient local search heuristic with row weighting for the unicost
// set covering problem", European Journal of Operational Research 246, 2015): faces are the rows, vertices the sets.
// Whenever all faces have a centre, one centre too many is dropped, and faces that stay without one for long weigh ever
// more.
class CenterSearch {
 public:
  explicit CenterSearch(const VertexStars& stars)
      : stars_(stars), vertices_(stars.vertex_count()), faces_(stars.face_count()) {
    for (VertexId v = 0; v < vertices_.size(); ++v) {
      vertices_[v].score = static_cast<std::int64_t>(stars.star(v).size());
    }
    for (FaceId face = 0; face < faces_.size(); ++face) expose(face);
  }

  void add(VertexId added) {
    enlist(added);
    std::int64_t kept = 0;  // what would be without a centre but for this one
    for (const CornerId corner : stars_.star(added)) {
      const FaceId id = face_of(corner);
      Face& face = faces_[id];
      for (const VertexId v : stars_.triangles()[id]) {
        vertices_[v].may_enter = true;
        if (v == added) continue;
        if (face.centers == 0 || (face.centers == 1 && is_center(v))) vertices_[v].score -= face.weight;
      }
      if (face.centers++ == 0) {
        shelter(id);
        kept += face.weight;
      }
    }
    vertices_[added].score = kept;
  }

  // Takes in centres until they reach all faces.
  void complete() {
    while (!exposed_.empty()) add(best_to_enter(exposed_[below(exposed_.size())]));
  }

  // The smallest set of centres found; another when it is called again. Precondition: those that are in reach all
  // faces.
  std::vector<VertexId> run(std::size_t steps) {
    std::vector<VertexId> best = centers_;
    VertexId latest = kNone;
    for (std::size_t step = 0; step < steps; ++step) {
      while (exposed_.empty() && !centers_.empty()) {
        best = centers_;
        remove(most_dispensable(centers_.size(), kNone));
      }
      const VertexId leaving = most_dispensable(kSamples, latest);
      if (leaving == kNone) break;
      ++now_;
      remove(leaving);
      latest = best_to_enter(exposed_[below(exposed_.size())]);
      add(latest);
      for (const FaceId face : exposed_) {
        ++faces_[face].weight;
        for (const VertexId v : stars_.triangles()[face]) ++vertices_[v].score;
      }
    }
    return exposed_.empty() ? centers_ : best;
  }

 private:
  // Of many centres only so many, picked at random, are compared for which is to leave.
  static constexpr std::size_t kSamples = 60;

  struct Vertex {
    std::int64_t score = 0;       // weight of the faces that would lose (a centre) or find (another) their only centre
    std::uint32_t changed = 0;    // when it became or ceased to be a centre
    std::uint32_t place = kNone;  // in centers_
    bool may_enter = true;        // something around it has changed since it ceased to be a centre
  };
  struct Face {
    std::int64_t weight = 1;
    std::uint32_t centers = 0;
    std::uint32_t place = kNone;  // in exposed_
  };

  bool is_center(VertexId v) const { return vertices_[v].place != kNone; }

  void remove(VertexId removed) {
    delist(removed);
    std::int64_t gain = 0;
    for (const CornerId corner : stars_.star(removed)) {
      const FaceId id = face_of(corner);
      Face& face = faces_[id];
      --face.centers;
      for (const VertexId v : stars_.triangles()[id]) {
        vertices_[v].may_enter = true;
        if (v == removed) continue;
        if (face.centers == 0 || (face.centers == 1 && is_center(v))) vertices_[v].score += face.weight;
      }
      if (face.centers == 0) {
        expose(id);
        gain += face.weight;
      }
    }
    vertices_[removed].score = gain;
    vertices_[removed].may_enter = false;
  }

  VertexId most_dispensable(std::size_t samples, VertexId but) {
    VertexId best = kNone;
    const bool all = centers_.size() <= samples;
    for (std::size_t i = 0, end = std::min(samples, centers_.size()); i < end; ++i) {
      const VertexId v = centers_[all ? i : below(centers_.size())];
      if (v == but) continue;
      if (best == kNone || vertices_[v].score < vertices_[best].score ||
          (vertices_[v].score == vertices_[best].score && vertices_[v].changed < vertices_[best].changed)) {
        best = v;
      }
    }
    return best;
  }

  VertexId best_to_enter(FaceId face) {
    VertexId best = kNone;
    for (const VertexId v : stars_.triangles()[face]) {
      if (!vertices_[v].may_enter) continue;
      if (best == kNone || vertices_[v].score > vertices_[best].score ||
          (vertices_[v].score == vertices_[best].score && vertices_[v].changed < vertices_[best].changed)) {
        best = v;
      }
    }
    return best;  // a face has at most one corner that has just left
  }

  void enlist(VertexId v) {
    vertices_[v].place = static_cast<std::uint32_t>(centers_.size());
    vertices_[v].changed = now_;
    centers_.push_back(v);
  }
  void delist(VertexId v) {
    const std::uint32_t place = vertices_[v].place;
    centers_[place] = centers_.back();
    vertices_[centers_[place]].place = place;
    centers_.pop_back();
    vertices_[v].place = kNone;
    vertices_[v].changed = now_;
  }
  void expose(FaceId face) {
    faces_[face].place = static_cast<std::uint32_t>(exposed_.size());
    exposed_.push_back(face);
  }
  void shelter(FaceId face) {
    const std::uint32_t place = faces_[face].place;
    exposed_[place] = exposed_.back();
    faces_[exposed_[place]].place = place;
    exposed_.pop_back();
  }

  std::size_t below(std::size_t count) {
    state_ ^= state_ << 13U;
    state_ ^= state_ >> 17U;
    state_ ^= state_ << 5U;
    return static_cast<std::size_t>((std::uint64_t{state_} * count) >> 32U);
  }

  const VertexStars& stars_;
  std::vector<Vertex> vertices_;
  std::vector<Face> faces_;
  std::vector<VertexId> centers_;
  std::vector<FaceId> exposed_;  // without a centre
  std::uint32_t now_ = 1;
  std::uint32_t state_ = 2463534242U;
};

// Each face to that of its centres which has most faces so far.
FaceOwners owners_of(const VertexStars& stars, const std::vector<VertexId>& centers) {
  std::vector<std::uint32_t> owned(stars.vertex_count(), 0);
  for (const VertexId v : centers) owned[v] = 1;
  FaceOwners owners(stars.face_count());
  for (FaceId face = 0; face < owners.size(); ++face) {
    const Triangle& t = stars.triangles()[face];
    VertexId owner = t[0];
    for (const VertexId v : t) owner = owned[v] > owned[owner] ? v : owner;
    owners[face] = owner;
    ++owned[owner];
  }
  return owners;
}

// Mostly all faces of a centre soon lie side by side; more sweeps are worth it only where some do not. Returns the
// fans.
std::size_t share_out(const VertexStars& stars, std::size_t centers, int sweeps, FaceOwners& owners) {
  constexpr int kSweepsAtOnce = 8;
  std::size_t fans = fan_count(stars, owners);
  for (int done = 0; done < sweeps && (done == 0 || fans > centers); done += kSweepsAtOnce) {
    improve_owners(stars, std::min(kSweepsAtOnce, sweeps - done), owners);
    fans = fan_count(stars, owners);
  }
  return fans;
}

}  // namespace

void search_centers(const VertexStars& stars, const CenterSearchEffort& effort, FaceOwners& owners) {
  std::vector<std::uint8_t> is_center(stars.vertex_count(), 0);
  for (const VertexId owner : owners) is_center[owner] = 1;
  CenterSearch search(stars);
  for (VertexId v = 0; v < is_center.size(); ++v) {
    if (is_center[v] != 0) search.add(v);
  }
  std::size_t fewest = fan_count(stars, owners);
  for (int i = 0; i < effort.tries; ++i) {
    search.complete();
    const std::vector<VertexId> centers = search.run(effort.steps);
    FaceOwners found = owners_of(stars, centers);
    const std::size_t fans = share_out(stars, centers.size(), effort.sweeps, found);
    if (fans < fewest) {
      fewest = fans;
      owners = std::move(found);
    }
    if (fewest <= centers.size()) break;
  }
}

}  // namespace fanstream
