#include "common/import/fan_splitting.h"

#include <algorithm>
#include <array>

namespace fanstream {
namespace {

class FanSplitter {
 public:
  FanSplitter(TriangleMesh& mesh, FacePairing& pairing)
      : mesh_(mesh), opposite_(pairing.opposite), original_count_(mesh.positions.size()) {}

  FanSplitCounts run(bool has_split_edges) {
    if (has_split_edges) original_ = mesh_.triangles;
    assign_fans();
    if (has_split_edges) {
      cut_repeated_neighbors();
      mesh_.triangles = original_;
      mesh_.positions.resize(original_count_);
      assign_fans();
    }
    FanSplitCounts counts;
    counts.split_vertices = mesh_.positions.size() - original_count_;
    if (has_split_edges) counts.split_edges = count_split_edges();
    return counts;
  }

 private:
  VertexId& vertex(HalfEdge corner) { return mesh_.triangles[corner / 3][corner % 3]; }
  VertexId ring_vertex(HalfEdge corner) { return vertex(next_in_triangle(corner)); }
  // The corner of the same vertex in the next face counter-clockwise, or kNoHalfEdge at a boundary; and clockwise.
  HalfEdge next_around(HalfEdge corner) const { return opposite_[previous_in_triangle(corner)]; }
  HalfEdge previous_around(HalfEdge corner) const {
    const HalfEdge o = opposite_[corner];
    return o == kNoHalfEdge ? kNoHalfEdge : next_in_triangle(o);
  }

  HalfEdge first_of_fan(HalfEdge corner) const {
    HalfEdge at = corner;
    for (HalfEdge before = previous_around(at); before != kNoHalfEdge; before = previous_around(at)) {
      if (before == corner) return corner;  // closed
      at = before;
    }
    return at;
  }

  // Calls use(first corner) once for each fan, in the order of their smallest corner. `use` may cut fans; those whose
  // turn has not come yet are met as they are by then.
  template <class Use>
  void for_each_fan(Use use) {
    std::vector<bool> seen(opposite_.size(), false);
    for (HalfEdge corner = 0; corner < opposite_.size(); ++corner) {
      if (seen[corner]) continue;
      const HalfEdge first = first_of_fan(corner);
      HalfEdge at = first;
      do {
        seen[at] = true;
        at = next_around(at);
      } while (at != kNoHalfEdge && at != first);
      use(first);
    }
  }

  // The first fan keeps the vertex, every further one gets a copy.
  void assign_fans() {
    std::vector<bool> taken(mesh_.positions.size(), false);
    for_each_fan([&](HalfEdge first) {
      const VertexId v = vertex(first);
      if (!taken[v]) {
        taken[v] = true;
        return;
      }
      HalfEdge at = first;
      const VertexId copy = add_copy(v);
      do {
        vertex(at) = copy;
        at = next_around(at);
      } while (at != kNoHalfEdge && at != first);
    });
  }

  VertexId add_copy(VertexId v) {
    const glm::dvec3 position = mesh_.positions[v];
    mesh_.positions.push_back(position);
    return static_cast<VertexId>(mesh_.positions.size() - 1);
  }

  // Cuts every fan into runs whose ring vertices differ. Each run has a vertex of its own at once, so a later fan sees
  // what earlier ones have become; later cuts only make more vertices differ, so one pass is enough.
  void cut_repeated_neighbors() {
    std::vector<HalfEdge> corners;
    std::vector<std::uint32_t> seen_in_run;  // per vertex: the run that met it last
    std::uint32_t run = 0;
    for_each_fan([&](HalfEdge first) {
      corners.clear();
      HalfEdge at = first;
      do {
        corners.push_back(at);
        at = next_around(at);
      } while (at != kNoHalfEdge && at != first);
      const bool closed = at == first;
      seen_in_run.resize(mesh_.positions.size(), 0);
      ++run;
      std::size_t start = corners.size();
      for (std::size_t i = 0; i < corners.size() && start == corners.size(); ++i) {
        if (seen_in_run[ring_vertex(corners[i])] == run) start = i;
        seen_in_run[ring_vertex(corners[i])] = run;
      }
      const VertexId last = vertex(previous_in_triangle(corners.back()));
      if (start == corners.size() && (closed || seen_in_run[last] != run)) return;
      if (closed) {
        // Between the two meetings, so that neither of them is where the runs begin and end.
        std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(start - 1), corners.end());
        open(corners.front());
      }
      cut_into_runs(corners, seen_in_run, run);
    });
  }

  void cut_into_runs(const std::vector<HalfEdge>& corners, std::vector<std::uint32_t>& seen_in_run,
                     std::uint32_t& run) {
    std::vector<std::size_t> cuts;
    ++run;
    seen_in_run[ring_vertex(corners[0])] = run;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const VertexId end = vertex(previous_in_triangle(corners[i]));
      if (seen_in_run[end] == run) {
        cuts.push_back(i);
        ++run;
        seen_in_run[ring_vertex(corners[i])] = run;
      }
      seen_in_run[end] = run;
    }
    for (std::size_t c = 0; c < cuts.size(); ++c) {
      open(corners[cuts[c]]);
      const VertexId copy = add_copy(vertex(corners[cuts[c]]));
      const std::size_t end = c + 1 < cuts.size() ? cuts[c + 1] : corners.size();
      for (std::size_t i = cuts[c]; i < end; ++i) vertex(corners[i]) = copy;
    }
    seen_in_run.resize(mesh_.positions.size(), 0);
  }

  void open(HalfEdge h) {
    const HalfEdge o = opposite_[h];
    if (o == kNoHalfEdge) return;
    opposite_[h] = opposite_[o] = kNoHalfEdge;
  }

  // Edges between two original vertices that are left with several instances.
  std::uint64_t count_split_edges() {
    std::vector<std::array<VertexId, 2>> instances;
    for (HalfEdge h = 0; h < opposite_.size(); ++h) {
      const HalfEdge o = opposite_[h];
      if (o != kNoHalfEdge && o < h) continue;
      const VertexId a = original_[h / 3][h % 3];
      const VertexId b = original_[h / 3][next_in_triangle(h) % 3];
      instances.push_back({std::min(a, b), std::max(a, b)});
    }
    std::sort(instances.begin(), instances.end());
    std::uint64_t count = 0;
    for (std::size_t i = 1; i < instances.size(); ++i) {
      const bool repeats = instances[i] == instances[i - 1];
      const bool counted = i > 1 && instances[i] == instances[i - 2];
      if (repeats && !counted) ++count;
    }
    return count;
  }

  TriangleMesh& mesh_;
  std::vector<HalfEdge>& opposite_;
  std::vector<Triangle> original_;  // before vertices were copied
  std::size_t original_count_;
};

}  // namespace

FanSplitCounts split_fans(TriangleMesh& mesh, FacePairing& pairing) {
  return FanSplitter(mesh, pairing).run(pairing.has_split_edges);
}

}  // namespace fanstream
