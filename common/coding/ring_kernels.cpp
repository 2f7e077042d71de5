#include "common/coding/ring_kernels.h"

#include <numeric>
#include <vector>

#include "common/coding/ring_kernels_common.h"

namespace fanstream {
namespace {

#define FANSTREAM_KERNEL
#define FANSTREAM_LANES inline
#include "common/coding/lanes8_portable.inc"
#include "common/coding/ring_kernels.inc"

}  // namespace

std::uint32_t nth_reach_of_long(const RingGeometry& ring, std::uint32_t length, std::uint32_t rank,
                                decltype(RingKernels::find_reaches) reaches_into) {
  std::vector<float> reaches(std::size_t{8} * ring.block_count());
  reaches_into(ring, length, reaches.data());
  std::vector<std::uint32_t> order(ring.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return reaches[a] > reaches[b]; });
  return order[rank];
}

const RingKernels& RingKernels::portable() {
  static constexpr RingKernels table = kernels("portable");
  return table;
}

const RingKernels& RingKernels::best() {
  static const RingKernels& table = avx2() != nullptr ? *avx2() : portable();
  return table;
}

RingFeatures ring_features(const RingGeometry& ring, const FanSplit& split) {
  return RingKernels::best().features(ring, split);
}

}  // namespace fanstream
