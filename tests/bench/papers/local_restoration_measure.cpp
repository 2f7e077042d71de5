#include "tests/bench/papers/local_restoration_measure.h"

#include <algorithm>
#include <cmath>

#include "client/collision/mesh_contacts.h"
#include "tests/bench/thread_clock.h"

namespace fanstream::bench {
namespace {

// The least of several rounds, each of all frames of a stretch, added up over stretches. Rounds of different ways are
// taken in turn.
class Rounds {
 public:
  template <class Way>
  void run(std::size_t frames, const Way& way) {
    const double start = thread_cpu_seconds();
    for (std::size_t f = 0; f < frames; ++f) way(f);
    best_s_ = std::min(best_s_, thread_cpu_seconds() - start);
    count_ = frames;
  }
  void end_stretch() {
    sum_s_ += best_s_;
    frames_ += static_cast<double>(count_);
    best_s_ = INFINITY;
  }
  double us_a_frame() const { return 1e6 * sum_s_ / frames_; }

 private:
  double best_s_ = INFINITY;
  std::size_t count_ = 0;
  double sum_s_ = 0.0, frames_ = 0.0;
};

void count_frame(const CollisionSubject& subject, const ContactFrame& frame, std::size_t plane_count,
                 CollisionFigures& sum) {
  const RestorationMove move = subject.local->move(frame.focus);
  PlaneContacts found;
  collide(subject.local->surface(), std::span(frame.planes).first(plane_count), found);
  sum.mean_splits += static_cast<double>(move.applied + move.undone);
  sum.mean_triangles += static_cast<double>(subject.local->surface().triangle_count());
  subject.local->surface().visit([](const Bounds&) { return true; },
                                 [&](const LiveTriangle& t) { sum.mean_original += t.original ? 1.0 : 0.0; });
  sum.mean_contacts += static_cast<double>(found.touching);
  sum.mean_tested += static_cast<double>(found.tested_triangles);
  const FocusTest focus(frame.focus);
  collide(subject.local->surface(), std::span(frame.planes).first(plane_count), found, &focus);
  sum.mean_within += static_cast<double>(found.touching);
}

struct Watches {
  Rounds restored, moving, within, one_by_one, full, full_tree, ball, ball_full;
};

// There and back, so that every round begins where the last one ended.
void measure_planes(const CollisionSubject& subject, const ContactPath& path, std::size_t plane_count,
                    Watches& watches) {
  PlaneContacts found;
  const std::size_t count = 2 * path.size();
  const auto frame = [&](std::size_t f) -> const ContactFrame& { return path[std::min(f, count - 1 - f)]; };
  const auto planes = [&](std::size_t f) { return std::span(frame(f).planes).first(plane_count); };
  watches.restored.run(count, [&](std::size_t f) {
    subject.local->move(frame(f).focus);
    collide(subject.local->surface(), planes(f), found);
  });
  watches.moving.run(count, [&](std::size_t f) { subject.local->move(frame(f).focus); });
  watches.within.run(count, [&](std::size_t f) {
    subject.local->move(frame(f).focus);
    const FocusTest focus(frame(f).focus);
    collide(subject.local->surface(), planes(f), found, &focus);
  });
  watches.full_tree.run(count, [&](std::size_t f) { collide(subject.refined->surface(), planes(f), found); });
  // Of a large full mesh a few frames tell as much as all do.
  const std::size_t full_frames = subject.full.triangles.size() > 50'000 ? 1 : std::min<std::size_t>(count, 50);
  watches.full.run(full_frames, [&](std::size_t f) { collide(subject.flat, planes(f), found); });
}

// At one place of a stretch, the focus standing still.
void measure_standing(const CollisionSubject& subject, const ContactFrame& frame, std::size_t plane_count, int rounds,
                      Watches& watches, CollisionFigures& sum) {
  subject.local->move(frame.focus);
  const SurfacePatch flat = patch_of(subject.local->surface().triangle_mesh());
  const MeshObstacle ball = MeshObstacle::create(frame.ball()).value();
  PlaneContacts found;
  const MeshContacts pairs = find_contacts(subject.local->surface(), ball);
  sum.mean_ball_tested += static_cast<double>(pairs.tested_triangles);
  sum.mean_ball_pairs += static_cast<double>(pairs.touching_pairs);
  for (int round = 0; round < rounds; ++round) {
    watches.one_by_one.run(1, [&](std::size_t) { collide(flat, std::span(frame.planes).first(plane_count), found); });
    watches.ball.run(1, [&](std::size_t) { find_contacts(subject.local->surface(), ball); });
    watches.ball_full.run(1, [&](std::size_t) { find_contacts(subject.refined->surface(), ball); });
  }
}

}  // namespace

CollisionFigures measure_collision(const CollisionSubject& subject, std::span<const ContactPath> stretches,
                                   std::size_t plane_count, int rounds) {
  CollisionFigures figures;
  Watches watches;
  double frames = 0.0;
  for (const ContactPath& path : stretches) {
    subject.local->move(path.front().focus);
    for (const ContactFrame& frame : path) count_frame(subject, frame, plane_count, figures);
    frames += static_cast<double>(path.size());
    subject.local->move(path.front().focus);
    for (int round = 0; round < rounds; ++round) measure_planes(subject, path, plane_count, watches);
    measure_standing(subject, path[path.size() / 2], plane_count, rounds, watches, figures);
    for (Rounds* r : {&watches.restored, &watches.moving, &watches.within, &watches.one_by_one, &watches.full,
                      &watches.full_tree, &watches.ball, &watches.ball_full}) {
      r->end_stretch();
    }
  }
  for (double* mean : {&figures.mean_triangles, &figures.mean_original, &figures.mean_splits, &figures.mean_contacts,
                       &figures.mean_tested, &figures.mean_within}) {
    *mean /= frames;
  }
  for (double* mean : {&figures.mean_ball_tested, &figures.mean_ball_pairs}) {
    *mean /= static_cast<double>(stretches.size());
  }
  figures.us_restored = watches.restored.us_a_frame();
  figures.us_move = watches.moving.us_a_frame();
  figures.us_within = watches.within.us_a_frame();
  figures.us_one_by_one = figures.us_move + watches.one_by_one.us_a_frame();
  figures.us_full = watches.full.us_a_frame();
  figures.us_full_tree = watches.full_tree.us_a_frame();
  figures.us_ball = watches.ball.us_a_frame();
  figures.us_ball_full = watches.ball_full.us_a_frame();
  return figures;
}

}  // namespace fanstream::bench
