#include "server/build/base_matching.h"

#include <algorithm>
#include <map>
#include <optional>
#include <unordered_map>

namespace fanstream {
namespace {

using PlaceKey = std::array<std::int32_t, 9>;

// The three places of a face, starting at its corner `corner`.
PlaceKey key_of(const BaseMesh& mesh, const Triangle& t, std::size_t corner) {
  PlaceKey key{};
  for (std::size_t i = 0; i < 3; ++i) {
    const GridPoint& p = mesh.places[t[(corner + i) % 3]];
    for (int axis = 0; axis < 3; ++axis) key[i * 3 + static_cast<std::size_t>(axis)] = p[axis];
  }
  return key;
}

std::uint64_t edge_key(VertexId a, VertexId b) { return static_cast<std::uint64_t>(a) << 32U | b; }

// The corner opposite each directed edge.
std::unordered_map<std::uint64_t, VertexId> opposites(const BaseMesh& mesh) {
  std::unordered_map<std::uint64_t, VertexId> result;
  result.reserve(mesh.triangles.size() * 3);
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) result[edge_key(t[i], t[(i + 1) % 3])] = t[(i + 2) % 3];
  }
  return result;
}

class Matcher {
 public:
  Matcher(const BaseMesh& original, const BaseMesh& decoded)
      : original_(original),
        decoded_(decoded),
        original_opposites_(opposites(original)),
        decoded_opposites_(opposites(decoded)),
        to_original_(decoded.places.size(), kOutside),
        to_decoded_(original.places.size(), kOutside) {
    for (const Triangle& t : original.triangles) {
      for (std::size_t c = 0; c < 3; ++c) seeds_[key_of(original, t, c)].push_back({t[c], t[(c + 1) % 3], t[(c + 2) % 3]});
    }
  }

  Result<std::vector<VertexId>> run() {
    const auto mismatch = [] { return fail(ErrorKind::bad_input, "the decoded base is not the mesh that was encoded"); };
    if (original_.places.size() != decoded_.places.size() || original_.triangles.size() != decoded_.triangles.size()) {
      return mismatch();
    }
    for (const Triangle& t : decoded_.triangles) {
      if (to_original_[t[0]] == kOutside && !match_component(t)) return mismatch();
    }
    return to_original_;
  }

 private:
  bool match_component(const Triangle& seed) {
    for (const Triangle& candidate : seeds_[key_of(decoded_, seed, 0)]) {
      if (to_decoded_[candidate[0]] == kOutside && walk(seed, candidate)) return true;
    }
    return false;
  }

  bool pair(VertexId decoded, VertexId original) {
    if (to_original_[decoded] == original) return true;
    if (to_original_[decoded] != kOutside || to_decoded_[original] != kOutside) return false;
    if (decoded_.places[decoded] != original_.places[original]) return false;
    to_original_[decoded] = original;
    to_decoded_[original] = decoded;
    paired_.push_back(decoded);
    return true;
  }

  // Pairs the whole component around a pair of faces, or nothing.
  bool walk(const Triangle& decoded, const Triangle& original) {
    paired_.clear();
    bool good = true;
    for (std::size_t c = 0; c < 3 && good; ++c) good = pair(decoded[c], original[c]);
    std::vector<Triangle> faces{decoded};
    std::unordered_map<std::uint64_t, bool> crossed;
    while (good && !faces.empty()) {
      const Triangle t = faces.back();
      faces.pop_back();
      for (std::size_t i = 0; i < 3 && good; ++i) {
        const VertexId a = t[(i + 1) % 3];
        const VertexId b = t[i];
        if (!crossed.emplace(edge_key(a, b), true).second) continue;
        const auto here = decoded_opposites_.find(edge_key(a, b));
        const auto there = original_opposites_.find(edge_key(to_original_[a], to_original_[b]));
        const bool here_open = here == decoded_opposites_.end();
        if (here_open != (there == original_opposites_.end())) good = false;
        if (!good || here_open) continue;
        good = pair(here->second, there->second);
        faces.push_back({a, b, here->second});
      }
    }
    if (!good) {
      for (const VertexId v : paired_) {
        to_decoded_[to_original_[v]] = kOutside;
        to_original_[v] = kOutside;
      }
    }
    return good;
  }

  const BaseMesh& original_;
  const BaseMesh& decoded_;
  std::unordered_map<std::uint64_t, VertexId> original_opposites_;
  std::unordered_map<std::uint64_t, VertexId> decoded_opposites_;
  std::map<PlaceKey, std::vector<Triangle>> seeds_;
  std::vector<VertexId> to_original_;
  std::vector<VertexId> to_decoded_;
  std::vector<VertexId> paired_;
};

}  // namespace

Result<std::vector<VertexId>> match_base(const BaseMesh& original, const BaseMesh& decoded) {
  return Matcher(original, decoded).run();
}

}  // namespace fanstream
