#include "common/mesh/polygon_cleaner.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace fanstream {
namespace {

constexpr std::uint32_t kNone = ~0U;

void weld(PolygonMesh& mesh, PolygonRepairs& repairs) {
  std::vector<VertexId> order(mesh.points.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](VertexId v) {
    const glm::dvec4& p = mesh.points[v];
    return std::array<double, 4>{p.x, p.y, p.z, p.w};
  };
  std::sort(order.begin(), order.end(), [&](VertexId a, VertexId b) {
    const auto ka = key(a);
    const auto kb = key(b);
    return ka < kb || (ka == kb && a < b);
  });
  std::vector<VertexId> target(mesh.points.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    target[order[i]] = same ? target[order[i - 1]] : order[i];
    repairs.welded_vertices += same ? 1 : 0;
  }
  for (VertexId& corner : mesh.corners) corner = target[corner];
}

// Faces that visit no vertex twice.
class FaceRebuilder {
 public:
  FaceRebuilder(PolygonMesh& mesh, PolygonRepairs& repairs)
      : mesh_(mesh), repairs_(repairs), place_in_path_(mesh.points.size(), kNone) {}

  void run() {
    for (FaceId f = 0; f < mesh_.face_count(); ++f) add(mesh_.face(f));
    drop_duplicates();
    mesh_.corners = std::move(result_.corners);
    mesh_.face_begins = std::move(result_.face_begins);
  }

 private:
  // Walks along the face; whenever a vertex comes up again, what lies between its two visits is a face of its own.
  void add(std::span<const VertexId> face) {
    path_.clear();
    std::size_t loops = 0;
    for (const VertexId v : face) {
      if (!path_.empty() && path_.back() == v) {
        ++repairs_.repeated_corners;
        continue;
      }
      if (place_in_path_[v] != kNone) loops += cut(place_in_path_[v]);
      if (!path_.empty() && path_.back() == v) continue;
      place_in_path_[v] = static_cast<std::uint32_t>(path_.size());
      path_.push_back(v);
    }
    loops += cut(0);
    if (!path_.empty()) place_in_path_[path_[0]] = kNone;
    if (loops == 0) ++repairs_.degenerate_faces;
    if (loops > 1) ++repairs_.cut_faces;
  }

  // The path from `begin` on becomes a face; its first vertex stays in the path. Returns how many faces it gave.
  std::size_t cut(std::size_t begin) {
    const std::span<const VertexId> loop = std::span<const VertexId>(path_).subspan(begin);
    const bool face = loop.size() >= 3;
    if (face) result_.add_face(loop);
    for (std::size_t i = begin + 1; i < path_.size(); ++i) place_in_path_[path_[i]] = kNone;
    path_.resize(std::min(path_.size(), begin + 1));
    return face ? 1 : 0;
  }

  void drop_duplicates() {
    std::vector<VertexId> sorted = result_.corners;
    std::vector<FaceId> order(result_.face_count());
    std::iota(order.begin(), order.end(), 0U);
    const auto key = [&](FaceId f) {
      return std::span(sorted).subspan(result_.face_begins[f], result_.face_begins[f + 1] - result_.face_begins[f]);
    };
    for (const FaceId f : order) std::sort(key(f).begin(), key(f).end());
    std::sort(order.begin(), order.end(), [&](FaceId a, FaceId b) {
      const auto ka = key(a);
      const auto kb = key(b);
      if (std::equal(ka.begin(), ka.end(), kb.begin(), kb.end())) return a < b;
      return std::lexicographical_compare(ka.begin(), ka.end(), kb.begin(), kb.end());
    });
    std::vector<bool> dropped(result_.face_count(), false);
    for (std::size_t i = 1; i < order.size(); ++i) {
      const auto a = key(order[i - 1]);
      const auto b = key(order[i]);
      if (!std::equal(a.begin(), a.end(), b.begin(), b.end())) continue;
      dropped[order[i]] = true;
      ++repairs_.duplicate_faces;
    }
    PolygonMesh kept;
    for (FaceId f = 0; f < result_.face_count(); ++f) {
      if (!dropped[f]) kept.add_face(result_.face(f));
    }
    result_ = std::move(kept);
  }

  PolygonMesh& mesh_;
  PolygonRepairs& repairs_;
  PolygonMesh result_;
  std::vector<VertexId> path_;
  std::vector<std::uint32_t> place_in_path_;
};

// Windings, joined half-edges and fans.
class Joiner {
 public:
  Joiner(PolygonMesh& mesh, PolygonRepairs& repairs) : mesh_(mesh), repairs_(repairs) {
    faces_.resize(mesh.corners.size());
    for (FaceId f = 0; f < mesh.face_count(); ++f) {
      for (std::uint32_t c = mesh.face_begins[f]; c < mesh.face_begins[f + 1]; ++c) faces_[c] = f;
    }
  }

  void run() {
    pair_half_edges();
    agree_on_windings();
    open_disagreeing();
    split_fans();
  }

 private:
  std::uint32_t next(std::uint32_t c) const {
    const FaceId f = faces_[c];
    return c + 1 == mesh_.face_begins[f + 1] ? mesh_.face_begins[f] : c + 1;
  }
  std::uint32_t previous(std::uint32_t c) const {
    const FaceId f = faces_[c];
    return (c == mesh_.face_begins[f] ? mesh_.face_begins[f + 1] : c) - 1;
  }
  VertexId start(std::uint32_t c) const { return mesh_.corners[c]; }
  VertexId end(std::uint32_t c) const { return mesh_.corners[next(c)]; }

  // Edges of exactly two faces, in whatever direction these run.
  void pair_half_edges() {
    twins_.assign(mesh_.corners.size(), kNone);
    std::vector<std::uint32_t> order(mesh_.corners.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto key = [&](std::uint32_t c) { return std::minmax({start(c), end(c)}); };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      const auto ka = key(a);
      const auto kb = key(b);
      return ka < kb || (ka == kb && a < b);
    });
    for (std::size_t i = 0; i < order.size();) {
      std::size_t last = i + 1;
      while (last < order.size() && key(order[last]) == key(order[i])) ++last;
      if (last - i == 2) {
        twins_[order[i]] = order[i + 1];
        twins_[order[i + 1]] = order[i];
      } else if (last - i > 2) {
        ++repairs_.opened_edges;
      }
      i = last;
    }
  }

  // From each component's first face on; then the fewer are flipped.
  void agree_on_windings() {
    std::vector<std::uint8_t> flip(mesh_.face_count(), 0);
    std::vector<bool> reached(mesh_.face_count(), false);
    std::vector<FaceId> component;
    for (FaceId seed = 0; seed < mesh_.face_count(); ++seed) {
      if (reached[seed]) continue;
      component = {seed};
      reached[seed] = true;
      std::size_t flipped = 0;
      for (std::size_t i = 0; i < component.size(); ++i) {
        const FaceId f = component[i];
        flipped += flip[f];
        for (std::uint32_t c = mesh_.face_begins[f]; c < mesh_.face_begins[f + 1]; ++c) {
          if (twins_[c] == kNone || reached[faces_[twins_[c]]]) continue;
          const FaceId g = faces_[twins_[c]];
          reached[g] = true;
          flip[g] = flip[f] ^ (start(c) == start(twins_[c]) ? 1 : 0);
          component.push_back(g);
        }
      }
      const bool invert = 2 * flipped > component.size();
      for (const FaceId f : component) flip[f] ^= invert ? 1 : 0;
    }
    for (FaceId f = 0; f < mesh_.face_count(); ++f) {
      if (flip[f] != 0) reverse(f);
    }
  }

  // Corner k of n becomes corner n - 1 - k, and its half-edge, now the other way, that of corner n - 2 - k.
  void reverse(FaceId f) {
    ++repairs_.flipped_faces;
    const std::uint32_t begin = mesh_.face_begins[f];
    const std::uint32_t n = mesh_.face_begins[f + 1] - begin;
    std::vector<std::uint32_t> twins(n);
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t moved = (2 * n - 2 - k) % n;
      twins[moved] = twins_[begin + k];
      if (twins[moved] != kNone) twins_[twins[moved]] = begin + moved;
    }
    std::copy(twins.begin(), twins.end(), twins_.begin() + begin);
    std::reverse(mesh_.corners.begin() + begin, mesh_.corners.begin() + begin + n);
  }

  void open_disagreeing() {
    for (std::uint32_t c = 0; c < twins_.size(); ++c) {
      if (twins_[c] == kNone || start(c) != start(twins_[c])) continue;
      twins_[twins_[c]] = kNone;
      twins_[c] = kNone;
      ++repairs_.opened_edges;
    }
  }

  // The first fan found at a vertex keeps it.
  void split_fans() {
    std::vector<bool> placed(mesh_.corners.size(), false);
    std::vector<bool> taken(mesh_.points.size(), false);
    std::vector<VertexId> vertex = mesh_.corners;
    for (std::uint32_t c = 0; c < mesh_.corners.size(); ++c) {
      if (placed[c]) continue;
      VertexId v = mesh_.corners[c];
      if (taken[v]) {
        const glm::dvec4 copy = mesh_.points[v];
        v = static_cast<VertexId>(mesh_.points.size());
        mesh_.points.push_back(copy);
        ++repairs_.split_vertices;
      } else {
        taken[v] = true;
      }
      std::uint32_t at = c;
      while (at != kNone && !placed[at]) {
        placed[at] = true;
        vertex[at] = v;
        at = twins_[previous(at)];
      }
      if (at != kNone) continue;  // went all round
      for (at = twins_[c] == kNone ? kNone : next(twins_[c]); at != kNone && !placed[at];) {
        placed[at] = true;
        vertex[at] = v;
        at = twins_[at] == kNone ? kNone : next(twins_[at]);
      }
    }
    mesh_.corners = std::move(vertex);
  }

  PolygonMesh& mesh_;
  PolygonRepairs& repairs_;
  std::vector<FaceId> faces_;
  std::vector<std::uint32_t> twins_;
};

void drop_unused(PolygonMesh& mesh, PolygonRepairs& repairs) {
  std::vector<VertexId> number(mesh.points.size(), kNone);
  for (const VertexId v : mesh.corners) number[v] = 0;
  VertexId used = 0;
  for (VertexId v = 0; v < number.size(); ++v) {
    if (number[v] == kNone) continue;
    mesh.points[used] = mesh.points[v];
    number[v] = used++;
  }
  repairs.unreferenced_vertices = mesh.points.size() - used - repairs.welded_vertices;
  mesh.points.resize(used);
  for (VertexId& v : mesh.corners) v = number[v];
}

}  // namespace

std::vector<std::pair<std::string, std::uint64_t>> named_counts(const PolygonRepairs& repairs) {
  return {{"welded_vertices", repairs.welded_vertices},   {"unreferenced_vertices", repairs.unreferenced_vertices},
          {"repeated_corners", repairs.repeated_corners}, {"cut_faces", repairs.cut_faces},
          {"degenerate_faces", repairs.degenerate_faces}, {"duplicate_faces", repairs.duplicate_faces},
          {"flipped_faces", repairs.flipped_faces},       {"opened_edges", repairs.opened_edges},
          {"split_vertices", repairs.split_vertices}};
}

PolygonRepairs clean_polygons(PolygonMesh& mesh) {
  PolygonRepairs repairs;
  weld(mesh, repairs);
  FaceRebuilder(mesh, repairs).run();
  Joiner(mesh, repairs).run();
  drop_unused(mesh, repairs);
  return repairs;
}

}  // namespace fanstream
