#include "common/geometry/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace fanstream {

namespace {

// Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014. The standard library's distributions
// give other numbers on other platforms.
class SplitMix64 {
 public:
  explicit SplitMix64(std::uint64_t seed) : state_(seed) {}
  // Uniform in [0, 1).
  double next() {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
  }

 private:
  std::uint64_t state_;
};

class Measurement {
 public:
  explicit Measurement(const TriangleTree& surface) : surface_(surface) {}

  double measure(const glm::dvec3& sample) {
    const SurfacePoint nearest = surface_.closest(sample, last_slot_);
    last_slot_ = nearest.slot;
    const double distance = std::sqrt(nearest.squared_distance);
    ++result_.samples;
    if (distance > result_.max || result_.samples == 1) {
      result_.max = distance;
      result_.max_position = sample;
    }
    return distance;
  }
  void add_to_vertices(double distance) { vertices_.add(distance); }
  void add_to_area(double distance) { area_.add(distance); }

  DirectedDistance result() const {
    DirectedDistance finished = result_;
    const Sum& sum = area_.count > 0 ? area_ : vertices_;
    finished.mean = sum.distance / static_cast<double>(sum.count);
    finished.rms = std::sqrt(sum.squared / static_cast<double>(sum.count));
    return finished;
  }

 private:
  struct Sum {
    double distance = 0.0;
    double squared = 0.0;
    std::size_t count = 0;
    void add(double d) {
      distance += d;
      squared += d * d;
      ++count;
    }
  };
  const TriangleTree& surface_;
  std::uint32_t last_slot_ = 0;
  DirectedDistance result_;
  Sum vertices_;
  Sum area_;
};

// Uniform over the triangle: Turk, "Generating random points in triangles", Graphics Gems, 1990.
glm::dvec3 random_point(const TriangleMesh& mesh, const Triangle& t, SplitMix64& random) {
  const double s = std::sqrt(random.next());
  const double r = random.next();
  return mesh.positions[t[0]] * (1.0 - s) + mesh.positions[t[1]] * (s * (1.0 - r)) + mesh.positions[t[2]] * (s * r);
}

// Triangles of `from` in `order`, which should go over the surface in small steps.
DirectedDistance measure(const TriangleMesh& from, const std::vector<std::uint32_t>& order, const TriangleTree& to,
                         const DistanceOptions& options) {
  double total_area = 0.0;
  for (const std::uint32_t i : order) total_area += area_of(from, from.triangles[i]);
  const std::size_t face_samples = total_area > 0.0 ? options.face_samples : 0;

  Measurement measurement(to);
  SplitMix64 random(options.seed);
  std::vector<bool> visited(from.positions.size(), false);
  std::size_t stratum = 0;
  // Where on the running total of the areas the next face sample lies.
  const auto draw = [&] {
    return total_area * (static_cast<double>(stratum) + random.next()) / static_cast<double>(face_samples);
  };
  double next_sample = face_samples > 0 ? draw() : 0.0;
  double area_so_far = 0.0;
  std::size_t last_with_area = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Triangle& t = from.triangles[order[i]];
    for (const VertexId v : t) {
      if (visited[v]) continue;
      visited[v] = true;
      measurement.add_to_vertices(measurement.measure(from.positions[v]));
    }
    const double area = area_of(from, t);
    if (area > 0.0) last_with_area = i;
    area_so_far += area;
    for (; stratum < face_samples && next_sample < area_so_far; next_sample = draw()) {
      measurement.add_to_area(measurement.measure(random_point(from, t, random)));
      ++stratum;
    }
  }
  // The running total may end one rounding below the last sample.
  for (; stratum < face_samples; ++stratum) {
    measurement.add_to_area(measurement.measure(random_point(from, from.triangles[order[last_with_area]], random)));
  }
  return measurement.result();
}

double diagonal_of_surface(const TriangleMesh& mesh) {
  std::vector<glm::dvec3> corners;
  corners.reserve(mesh.triangles.size() * 3);
  for (const Triangle& t : mesh.triangles) {
    for (const VertexId v : t) corners.push_back(mesh.positions[v]);
  }
  return bounds_of(corners).diagonal();
}

double relative(double distance, double diagonal) { return diagonal > 0.0 ? distance / diagonal : 0.0; }

}  // namespace

double MeshDistance::rms() const { return std::max(forward.rms, backward.rms); }
double MeshDistance::mean() const { return std::max(forward.mean, backward.mean); }
double MeshDistance::max() const { return std::max(forward.max, backward.max); }
double MeshDistance::relative_rms() const { return relative(rms(), diagonal); }
double MeshDistance::relative_mean() const { return relative(mean(), diagonal); }
double MeshDistance::relative_max() const { return relative(max(), diagonal); }

Result<DirectedDistance> directed_distance(const TriangleMesh& from, const TriangleTree& to,
                                           const DistanceOptions& options) {
  // Its own tree checks the mesh and gives an order along the surface, which saves more than building it takes.
  const Result<TriangleTree> tree = TriangleTree::build(from);
  if (!tree) return tl::unexpected<Error>(tree.error());
  return measure(from, tree->triangles_in_order(), to, options);
}

Result<MeshDistance> mesh_distance(const TriangleMesh& a, const TriangleTree& tree_of_a, const TriangleMesh& b,
                                   const DistanceOptions& options) {
  const Result<TriangleTree> tree_of_b = TriangleTree::build(b);
  if (!tree_of_b) return tl::unexpected<Error>(with_context(tree_of_b.error(), "second mesh"));
  MeshDistance distance;
  distance.forward = measure(a, tree_of_a.triangles_in_order(), *tree_of_b, options);
  distance.backward = measure(b, tree_of_b->triangles_in_order(), tree_of_a, options);
  distance.diagonal = diagonal_of_surface(a);
  return distance;
}

Result<MeshDistance> mesh_distance(const TriangleMesh& a, const TriangleMesh& b, const DistanceOptions& options) {
  const Result<TriangleTree> tree_of_a = TriangleTree::build(a);
  if (!tree_of_a) return tl::unexpected<Error>(with_context(tree_of_a.error(), "first mesh"));
  return mesh_distance(a, *tree_of_a, b, options);
}

}  // namespace fanstream
