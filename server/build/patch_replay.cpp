#include "server/build/patch_replay.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

namespace fanstream {
namespace {

// Where a point lies on a curve through the model's box that keeps neighbours together (Morton).
std::uint64_t place_on_curve(const glm::vec3& place) {
  const auto spread = [](float value) {
    std::uint64_t bits = static_cast<std::uint32_t>(value);
    bits = (bits | bits << 32U) & 0x001F00000000FFFFU;
    bits = (bits | bits << 16U) & 0x001F0000FF0000FFU;
    bits = (bits | bits << 8U) & 0x100F00F00F00F00FU;
    bits = (bits | bits << 4U) & 0x10C30C30C30C30C3U;
    return (bits | bits << 2U) & 0x1249249249249249U;
  };
  return spread(place.x) | spread(place.y) << 1U | spread(place.z) << 2U;
}

}  // namespace

PatchReplay::PatchReplay(const std::vector<Triangle>& triangles, std::vector<GridPoint> codes, const PositionGrid& grid,
                         const CodedHistory& coded)
    : coded_(coded), grid_(grid), codes_(std::move(codes)), patch_of_(coded.history.merges.size()) {
  place_vertices(triangles);
  place_faces(triangles);
}

glm::vec3 PatchReplay::value_of(const GridPoint& code) const {
  const glm::dvec3 steps = (grid_.decode(code) - grid_.decode(GridPoint(0))) / grid_.step();
  return {std::round(steps.x), std::round(steps.y), std::round(steps.z)};
}

// All of the full model is worked through again and again: what lies together is stored together.
void PatchReplay::place_vertices(const std::vector<Triangle>& triangles) {
  struct Entry {
    std::uint64_t at;
    VertexId v;
  };
  std::vector<Entry> entries(codes_.size());
  for (VertexId v = 0; v < entries.size(); ++v) entries[v] = {place_on_curve(value_of(codes_[v])), v};
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.at != b.at ? a.at < b.at : a.v < b.v; });
  number_.resize(codes_.size());
  places_.resize(codes_.size());
  for (std::uint32_t i = 0; i < entries.size(); ++i) {
    number_[entries[i].v] = i;
    places_[i] = value_of(codes_[entries[i].v]);
  }
  around_.resize(codes_.size());
  member_.assign(codes_.size(), kNone);
  patch_of_root_.assign(codes_.size(), kNone);
  for (const Triangle& t : triangles) {
    for (const VertexId v : t) ++around_[number_[v]].size;
  }
  std::uint32_t begin = 0;
  for (Range& range : around_) {
    range.begin = begin;
    begin += range.size;
    range.size = 0;
  }
  around_pool_.resize(begin);
}

// By their smallest vertices.
void PatchReplay::place_faces(const std::vector<Triangle>& triangles) {
  std::vector<std::uint32_t> first(codes_.size() + 1, 0);
  const auto smallest = [&](const Triangle& t) { return std::min({number_[t[0]], number_[t[1]], number_[t[2]]}); };
  for (const Triangle& t : triangles) ++first[smallest(t) + 1];
  for (std::size_t v = 0; v < codes_.size(); ++v) first[v + 1] += first[v];
  faces_.resize(triangles.size());
  for (const Triangle& t : triangles) {
    Face& face = faces_[first[smallest(t)]++];
    for (int i = 0; i < 3; ++i) face.corners[i] = number_[t[i]];
  }
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    for (const VertexId v : faces_[f].corners) around_pool_[around_[v].begin + around_[v].size++] = f;
  }
}

// The roots of a generation, the vertices each absorbs, and the roots' places afterwards.
void PatchReplay::gather_patches(std::uint32_t k) {
  const MergeHistory& history = coded_.history;
  const std::uint32_t begin = history.generation_begin[k];
  const std::uint32_t end = history.generation_begin[k + 1];
  first_patch_ += static_cast<std::uint32_t>(roots_.size());
  roots_.clear();
  root_codes_.clear();
  for (std::uint32_t m = begin; m < end; ++m) {
    const MergeRecord& merge = history.merges[m];
    const VertexId root = number_[merge.root];
    std::uint32_t& patch = patch_of_root_[root];
    if (patch == kNone || patch < first_patch_) {
      patch = first_patch_ + static_cast<std::uint32_t>(roots_.size());
      roots_.push_back(root);
      root_codes_.push_back(merge.root);
    }
    patch_of_[m] = patch;
    codes_[merge.root] = coded_.place_after(m, codes_[merge.root], codes_[merge.removed]);
  }
  gather_absorbed(begin, end);
  for (std::size_t p = 0; p < roots_.size(); ++p) places_[roots_[p]] = value_of(codes_[root_codes_[p]]);
  order_.resize(roots_.size());
  for (std::uint32_t p = 0; p < order_.size(); ++p) order_[p] = p;
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return roots_[a] < roots_[b]; });
}

// Absorbed vertices by patch.
void PatchReplay::gather_absorbed(std::uint32_t begin, std::uint32_t end) {
  absorbed_begin_.assign(roots_.size() + 1, 0);
  for (std::uint32_t m = begin; m < end; ++m) ++absorbed_begin_[patch_of_[m] - first_patch_ + 1];
  for (std::size_t p = 0; p < roots_.size(); ++p) absorbed_begin_[p + 1] += absorbed_begin_[p];
  absorbed_.resize(end - begin);
  for (std::uint32_t m = end; m-- > begin;) {
    absorbed_[--absorbed_begin_[patch_of_[m] - first_patch_ + 1]] = number_[coded_.history.merges[m].removed];
  }
  // Every count above has become the beginning of the patch before it.
  for (std::size_t p = 0; p < roots_.size(); ++p) absorbed_begin_[p] = absorbed_begin_[p + 1];
  absorbed_begin_[roots_.size()] = end - begin;
}

// The faces around the root and all that it absorbs. Those with one corner among them remain, with the root in its
// place.
void PatchReplay::cover(std::uint32_t p) {
  const auto absorbed = std::span(absorbed_).subspan(absorbed_begin_[p], absorbed_begin_[p + 1] - absorbed_begin_[p]);
  patch_ = first_patch_ + p;
  root_ = roots_[p];
  covered_.clear();
  member_[root_] = patch_;
  for (const VertexId v : absorbed) member_[v] = patch_;
  const auto add_around = [&](VertexId v) {
    for (std::uint32_t i = 0; i < around_[v].size; ++i) {
      const std::uint32_t f = around_pool_[around_[v].begin + i];
      if (faces_[f].is_gone() || is_covered(f)) continue;
      faces_[f].covered_by = patch_;
      covered_.push_back(f);
    }
  };
  add_around(root_);
  for (const VertexId v : absorbed) add_around(v);
}

void PatchReplay::make_star() {
  rest_.clear();
  for (const std::uint32_t f : covered_) {
    Face& face = faces_[f];
    int members = 0;
    int at = 0;
    for (int i = 0; i < 3; ++i) {
      if (member_[face.corners[i]] != patch_) continue;
      ++members;
      at = i;
    }
    if (members == 1) {
      rest_.push_back({f, face.corners[(at + 1) % 3], face.corners[(at + 2) % 3]});
    } else {
      face.corners[0] = kNone;
    }
  }
  order_rest();
  star_.clear();
  star_faces_.clear();
  extent_ = 0.0F;
  const auto around_begin = static_cast<std::uint32_t>(around_pool_.size());
  for (const StarFace& f : rest_) {
    Face& face = faces_[f.face];
    face.corners[0] = root_;
    face.corners[1] = f.from;
    face.corners[2] = f.to;
    face.in_star = star_.count();
    const glm::vec3 from = places_[f.from] - centre();
    const glm::vec3 to = places_[f.to] - centre();
    const glm::vec3 most = glm::max(glm::abs(from), glm::abs(to));
    extent_ = std::max({extent_, most.x, most.y, most.z});
    star_.add(from, to);
    star_faces_.push_back(f.face);
    around_pool_.push_back(f.face);
  }
  star_.finish(rest_.size() > 2 && rest_.back().to == rest_.front().from);
  around_[root_] = {around_begin, static_cast<std::uint32_t>(around_pool_.size()) - around_begin};
}

// Around the root; an open star from its first face on.
void PatchReplay::order_rest() {
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    const VertexId from = rest_[i].from;
    if (std::none_of(rest_.begin(), rest_.end(), [&](const StarFace& f) { return f.to == from; })) {
      std::swap(rest_[0], rest_[i]);
      break;
    }
  }
  for (std::size_t i = 1; i < rest_.size(); ++i) {
    const VertexId wanted = rest_[i - 1].to;
    for (std::size_t k = i; k < rest_.size(); ++k) {
      if (rest_[k].from != wanted) continue;
      std::swap(rest_[i], rest_[k]);
      break;
    }
  }
}

}  // namespace fanstream
