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
// The state of a path along a closed star whose faces all belong to the centre so far: it may end up closing the fan.
constexpr auto kAllCenter = static_cast<std::size_t>(kChoices);
constexpr std::size_t kStates = kChoices + 1;
using Scores = std::array<int, kStates>;

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
    // The faces of a closed star of two lie back to back: each is the other's outside.
    if (degree < 2 || (degree == 2 && stars_.closed(center))) return;
    gather(center);
    if (stars_.closed(center)) {
      choose_closed();
    } else {
      choose_open();
    }
    for (std::size_t i = 0; i < degree; ++i) {
      const StarFace& face = star_[i];
      const VertexId owner = best_[i] == kCenter ? center : best_[i] == kNext ? face.next : face.previous;
      owners_[face.face] = owner;
      ++owned_[owner];
    }
  }

 private:
  // Collects the star and takes its faces away from their owners.
  void gather(VertexId center) {
    const std::span<const CornerId> star = stars_.star(center);
    star_.resize(star.size());
    best_.resize(star.size());
    from_.resize(star.size());
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

  // Advances the best scores of the paths that end in each state by one face; remembers where they came from.
  void advance(std::size_t i, Scores& score) {
    const StarFace& face = star_[i];
    std::uint8_t top = kCenter;
    if (score[kNext] > score[top]) top = kNext;
    if (score[kPrevious] > score[top]) top = kPrevious;
    const std::uint8_t top_of_all = score[kAllCenter] > score[top] ? kAllCenter : top;
    Scores after{score[top], score[top_of_all], score[top_of_all], score[kAllCenter] + kJoin};
    from_[i] = {top, top_of_all, top_of_all, kAllCenter};
    if (score[kCenter] + kJoin > after[kCenter]) {
      after[kCenter] = score[kCenter] + kJoin;
      from_[i][kCenter] = kCenter;
    }
    if (score[kPrevious] + face.join_before > after[kNext]) {
      after[kNext] = score[kPrevious] + face.join_before;
      from_[i][kNext] = kPrevious;
    }
    for (std::size_t choice = 0; choice < kChoices; ++choice) score[choice] = after[choice] + face.gain[choice];
    score[kAllCenter] = after[kAllCenter] + face.gain[kCenter];
  }

  void trace_back(std::size_t last) {
    for (std::size_t i = star_.size(); i-- > 0;) {
      best_[i] = last == kAllCenter ? kCenter : static_cast<Choice>(last);
      last = from_[i][last];
    }
  }

  void choose_open() {
    Scores score{star_[0].gain[kCenter], star_[0].gain[kNext], star_[0].gain[kPrevious], kNever};
    for (std::size_t i = 1; i < star_.size(); ++i) advance(i, score);
    trace_back(static_cast<std::size_t>(std::max_element(score.begin(), score.end()) - score.begin()));
  }

  // Around a closed star: once for each choice at the first face, which the last face then meets. A fan that closes
  // gains the last join and pays it for the closing.
  void choose_closed() {
    int best = kNever;
    for (const Choice first : {kCenter, kNext, kPrevious}) {
      Scores score{kNever, kNever, kNever, kNever};
      score[first == kCenter ? kAllCenter : static_cast<std::size_t>(first)] = star_[0].gain[first];
      for (std::size_t i = 1; i < star_.size(); ++i) advance(i, score);
      if (first == kCenter) score[kCenter] += kJoin;
      if (first == kNext) score[kPrevious] += star_[0].join_before;
      const auto last = static_cast<std::size_t>(std::max_element(score.begin(), score.end()) - score.begin());
      if (score[last] <= best) continue;
      best = score[last];
      trace_back(last);
    }
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
  std::vector<Choice> best_;
  std::vector<std::array<std::uint8_t, kStates>> from_;
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
