#include <algorithm>
#include <array>

#include "common/fans/cover_search.h"

namespace fanstream {
namespace {

// Every inner edge whose two faces are owned by the same end of it joins them into one fan, so
//   fans = faces - joins + closed fans,
// and the fewest fans are the most joins, a closed fan costing one. Scores count kJoin per join; below that, ties go
// mostly to the larger fan (small ones wither until they can be dropped) and otherwise to chance.
constexpr int kJoin = 128;
constexpr int kNever = -(1 << 28);
constexpr std::uint32_t kTiePreference = 4;  // at most, for a fan of as many faces or more
constexpr std::uint32_t kTieNoise = 3;       // a mask
// The preferences of a whole star of this size stay below one join; in larger stars ties are left as they fall.
constexpr std::size_t kLargestTieStar = 16;
static_assert(kLargestTieStar * (kTiePreference + kTieNoise) < kJoin);

// Who may own a face (v, a, b) of the star of v.
enum Choice : std::uint8_t { kCenter, kNext, kPrevious, kChoices };
constexpr std::size_t kLargestStar = 32;  // what the choices of a path have room for

// The best choices for the faces of a star so far, two bits each, and what they gain.
struct Path {
  int score = kNever;
  std::uint64_t choices = 0;
};

// Written so that compilers need no branch: which of two paths is better is anybody's guess.
inline Path better(const Path& a, const Path& b) {
  const bool first = a.score >= b.score;
  return {first ? a.score : b.score, first ? a.choices : b.choices};
}
inline Path plus(const Path& path, int gain) { return {path.score + gain, path.choices}; }

// The best paths that end in each choice. A path along a closed star whose faces all belong to the centre so far is
// kept apart: it may end up closing the fan.
struct Paths {
  Path center, next, previous, all_center;
};

struct StarFace {
  FaceId face;
  VertexId next, previous;         // a and b
  std::array<int, kChoices> gain;  // joins across the outer edge (a, b), plus the preference among equals
  int join_before;                 // what the face before it and this one gain by both belonging to `next`
};

class StarSearch {
 public:
  StarSearch(const VertexStars& stars, FaceOwners& owners)
      : stars_(stars), owners_(owners), owned_(stars.vertex_count()) {
    for (const VertexId owner : owners) ++owned_[owner];
  }

  void improve(VertexId center) {
    const std::size_t degree = stars_.star(center).size();
    // The faces of a closed star of two lie back to back: each is the other's outside. A huge star is left to the stars
    // of its ring, which hold all its faces too.
    if (degree < 2 || degree > kLargestStar || (degree == 2 && stars_.closed(center))) return;
    gather(center);
    std::uint64_t choices = stars_.closed(center) ? best_of_closed() : best_of_open();
    for (const StarFace& face : star_) {
      const auto choice = static_cast<Choice>(choices & 3U);
      choices >>= 2U;
      const VertexId owner = choice == kCenter ? center : choice == kNext ? face.next : face.previous;
      owners_[face.face] = owner;
      ++owned_[owner];
    }
  }

 private:
  // Collects the star and takes its faces away from their owners.
  void gather(VertexId center) {
    const std::span<const CornerId> star = stars_.star(center);
    star_.resize(star.size());
    for (std::size_t i = 0; i < star.size(); ++i) {
      const CornerId corner = star[i];
      StarFace& face = star_[i];
      face.face = face_of(corner);
      face.next = stars_.vertex(next_corner(corner));
      face.previous = stars_.vertex(previous_corner(corner));
      const FaceId outside = stars_.face_across(corner);
      const VertexId outside_owner = outside == kNone ? kNone : owners_[outside];
      face.gain = {0, outside_owner == face.next ? kJoin : 0, outside_owner == face.previous ? kJoin : 0};
      --owned_[owners_[face.face]];
    }
    for (StarFace& face : star_) {
      // Two more faces would close the fan of `next`: then the first join of the two only makes up for the closing.
      const bool closes = stars_.closed(face.next) && owned_[face.next] + 2 == stars_.star(face.next).size();
      face.join_before = closes ? 0 : kJoin;
    }
    if (star.size() <= kLargestTieStar) prefer_among_equals();
  }

  void prefer_among_equals() {
    for (StarFace& face : star_) {
      const std::uint32_t noise = random();
      const auto preference = [&](VertexId vertex, unsigned shift) {
        return static_cast<int>(std::min(owned_[vertex], kTiePreference) + ((noise >> shift) & kTieNoise));
      };
      face.gain[kCenter] += static_cast<int>(noise & kTieNoise);
      face.gain[kNext] += preference(face.next, 8);
      face.gain[kPrevious] += preference(face.previous, 16);
    }
  }

  // The paths with face i added.
  void advance(std::size_t i, Paths& paths) const {
    const StarFace& face = star_[i];
    const Path top = better(paths.center, better(paths.next, paths.previous));
    const Path top_of_all = better(top, paths.all_center);
    paths.center = choose(i, kCenter, better(top, plus(paths.center, kJoin)));
    paths.next = choose(i, kNext, better(top_of_all, plus(paths.previous, face.join_before)));
    paths.previous = choose(i, kPrevious, top_of_all);
    paths.all_center = choose(i, kCenter, plus(paths.all_center, kJoin));
  }

  Path choose(std::size_t i, Choice choice, const Path& path) const {
    return {path.score + star_[i].gain[choice], path.choices | std::uint64_t{choice} << (2 * i)};
  }

  std::uint64_t best_of_open() const {
    Paths paths{choose(0, kCenter, {0, 0}), choose(0, kNext, {0, 0}), choose(0, kPrevious, {0, 0}), {}};
    for (std::size_t i = 1; i < star_.size(); ++i) advance(i, paths);
    return better(paths.center, better(paths.next, paths.previous)).choices;
  }

  // Around a closed star: once for each choice at the first face, which the last face then meets. A fan that closes
  // gains the last join and pays it for the closing.
  std::uint64_t best_of_closed() const {
    Paths from_center{{}, {}, {}, choose(0, kCenter, {0, 0})};
    Paths from_next{{}, choose(0, kNext, {0, 0}), {}, {}};
    Paths from_previous{{}, {}, choose(0, kPrevious, {0, 0}), {}};
    for (std::size_t i = 1; i < star_.size(); ++i) {
      advance(i, from_center);
      advance(i, from_next);
      advance(i, from_previous);
    }
    from_center.center.score += kJoin;
    from_next.previous.score += star_[0].join_before;
    Path best = from_center.all_center;
    for (const Paths& paths : {from_center, from_next, from_previous}) {
      best = better(best, better(paths.center, better(paths.next, paths.previous)));
    }
    return best.choices;
  }

  std::uint32_t random() {
    state_ ^= state_ << 13U;
    state_ ^= state_ >> 17U;
    state_ ^= state_ << 5U;
    return state_;
  }

  const VertexStars& stars_;
  FaceOwners& owners_;
  std::vector<std::uint32_t> owned_;  // faces owned by each vertex
  std::vector<StarFace> star_;
  std::uint32_t state_ = 2463534242U;
};

}  // namespace

void improve_owners(const VertexStars& stars, int sweeps, FaceOwners& owners) {
  StarSearch search(stars, owners);
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (VertexId vertex = 0; vertex < stars.vertex_count(); ++vertex) search.improve(vertex);
  }
}

}  // namespace fanstream
