#include "server/build/merge_valences.h"

#include <algorithm>
#include <cmath>

namespace fanstream {
namespace {

// Measured (COSTS.md, section 6).
constexpr double kIrregularity = 0.05;
constexpr double kCoarseVertices = 512.0;

constexpr int kWorse = 2;  // than the best case, in odd valences, of the ends or of a wing

double square(double x) { return x * x; }
bool is_odd(std::size_t n) { return n % 2 != 0; }

}  // namespace

MergeValences valences_after(const MergedRing& ring, const RingMesh& rings, VertexId root, VertexId removed) {
  MergeValences valences;
  if (ring.is_open()) {  // the outside is in the ring as well
    valences.irregularity = square(static_cast<double>(ring.size()) - 5.0);
    valences.odd = 1;
  } else {
    valences.irregularity = square(static_cast<double>(ring.size()) - 6.0);
    valences.odd = is_odd(rings.ring_size(root)) && is_odd(rings.ring_size(removed)) ? 0 : kWorse;
  }
  for (const VertexId wing : {ring.id(0), ring.id(ring.arc())}) {
    if (wing == kOutside) {
      ++valences.odd;
      continue;
    }
    const std::size_t before = rings.ring_size(wing);
    valences.irregularity += square(static_cast<double>(before) - 7.0);
    valences.odd += is_odd(before) ? 0 : kWorse;
  }
  return valences;
}

double parity_share(std::uint32_t vertices) {
  return vertices <= kCoarseVertices ? 1.0 : square(square(kCoarseVertices / vertices));
}

double cost_with_valences(double own, double cost, double limit, const MergeValences& valences, double parity) {
  if (cost >= limit) return cost;
  const double regular = std::min(cost + kIrregularity * (1.0 - parity) * own * valences.irregularity, limit);
  const double x = parity * valences.odd;
  return std::isinf(limit) ? regular * (1.0 + x) : regular + (limit - regular) * (x / (1.0 + x));
}

}  // namespace fanstream
