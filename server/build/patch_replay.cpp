#include "server/build/patch_replay.h"

#include <algorithm>

#include "common/support/cache_lines.h"
#include "server/build/processors.h"

namespace fanstream {

PatchReplay::PatchReplay(const PlacedMesh& mesh, const CodedHistory& coded)
    : mesh_(mesh),
      coded_(coded),
      codes_(mesh.codes),
      places_(mesh.places),
      faces_(mesh.faces.size()),
      around_(mesh.around),
      member_(mesh.places.size(), kNone),
      patch_of_root_(mesh.places.size(), kNone),
      patch_of_(coded.history.merges.size()) {
  for (std::uint32_t part = 0; part < mesh.part_count(); ++part) {
    for (std::uint32_t f = mesh.part_begin(part); f < mesh.part_begin(part + 1); ++f) {
      std::copy_n(mesh.faces[f].begin(), 3, faces_[f].corners);
      faces_[f].parts = static_cast<std::uint8_t>(1U << part);
    }
  }
}

// The next generation is replayed beside those who follow the one at hand.
void PatchReplay::run(std::size_t followers, const std::function<void(const GenerationStars&, std::size_t)>& follow) {
  const unsigned threads = threads_worth_while(mesh_.faces.size());
  GenerationStars now, next;
  bool more = replay_next(now);
  while (more) {
    run_side_by_side(threads, followers + 1, [&](std::size_t i) {
      if (i == 0) {
        more = replay_next(next);
      } else {
        follow(now, i - 1);
      }
    });
    std::swap(now, next);
  }
}

// Merges a generation's patches and tells what they were. False, and nothing told, if there is none left.
bool PatchReplay::replay_next(GenerationStars& stars) {
  if (generation_ == coded_.history.generation_count()) return false;
  gather_patches(generation_++);
  stars.clear();
  stars.numbers_end = first_patch_ + static_cast<std::uint32_t>(roots_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) {
    fetch(i);
    const std::size_t covered_begin = stars.covered.size();
    cover(order_[i], stars);
    leave_star(std::span(stars.covered).subspan(covered_begin), stars);
  }
  return true;
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
    const VertexId root = mesh_.number[merge.root];
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
  for (std::size_t p = 0; p < roots_.size(); ++p) places_[roots_[p]] = mesh_.place_of(codes_[root_codes_[p]]);
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
    absorbed_[--absorbed_begin_[patch_of_[m] - first_patch_ + 1]] = mesh_.number[coded_.history.merges[m].removed];
  }
  // Every count above has become the beginning of the patch before it.
  for (std::size_t p = 0; p < roots_.size(); ++p) absorbed_begin_[p] = absorbed_begin_[p + 1];
  absorbed_begin_[roots_.size()] = end - begin;
}

// The faces around the root and all that it absorbs.
void PatchReplay::cover(std::uint32_t p, GenerationStars& stars) {
  const auto absorbed = std::span(absorbed_).subspan(absorbed_begin_[p], absorbed_begin_[p + 1] - absorbed_begin_[p]);
  patch_ = first_patch_ + p;
  root_ = roots_[p];
  member_[root_] = patch_;
  cover_around(root_, stars);
  for (const VertexId v : absorbed) {
    member_[v] = patch_;
    cover_around(v, stars);
  }
}

void PatchReplay::cover_around(VertexId v, GenerationStars& stars) {
  for (const std::uint32_t f : around_.of(v)) {
    Face& face = faces_[f];
    if (face.is_gone() || face.covered_by == patch_) continue;
    face.covered_by = patch_;
    stars.covered.push_back(f);
  }
}

// Those with one corner among the patch's vertices remain, with the root in its place.
void PatchReplay::leave_star(std::span<const std::uint32_t> covered, GenerationStars& stars) {
  rest_.clear();
  std::uint8_t parts = 0;
  for (const std::uint32_t f : covered) {
    Face& face = faces_[f];
    parts |= face.parts;
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
  const glm::vec3& centre = places_[root_];
  const std::span<std::uint32_t> around = around_.replace(root_, rest_.size());
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    const StarFace& f = rest_[i];
    Face& face = faces_[f.face];
    face.corners[0] = root_;
    face.corners[1] = f.from;
    face.corners[2] = f.to;
    face.parts = parts;
    around[i] = f.face;
    stars.star.push_back({f.face, places_[f.from] - centre, places_[f.to] - centre});
  }
  const bool closed = rest_.size() > 2 && rest_.back().to == rest_.front().from;
  stars.patches.push_back({patch_, centre, static_cast<std::uint32_t>(stars.covered.size()),
                           static_cast<std::uint32_t>(stars.star.size()), closed, parts});
}

// What patches some way on will need.
void PatchReplay::fetch(std::size_t at) const {
  constexpr std::size_t kRanges = 12;
  constexpr std::size_t kFaces = 6;
  if (at + kRanges < order_.size()) fetch_line(around_.of(roots_[order_[at + kRanges]]).data());
  if (at + kFaces < order_.size()) {
    for (const std::uint32_t f : around_.of(roots_[order_[at + kFaces]])) fetch_line(&faces_[f]);
  }
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
