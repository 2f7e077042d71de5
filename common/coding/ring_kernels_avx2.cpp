#include "common/coding/ring_kernels_common.h"

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>

namespace fanstream {
namespace {

// By function, not by the compiler's flags for the file: what else the file instantiates may end up anywhere in the
// program.
#define FANSTREAM_KERNEL [[gnu::target("avx2,bmi,bmi2,popcnt")]]
#define FANSTREAM_LANES [[gnu::target("avx2,bmi,bmi2,popcnt"), gnu::always_inline]] inline
#include "common/coding/lanes8_avx2.inc"
#include "common/coding/ring_kernels.inc"

}  // namespace

const RingKernels* RingKernels::avx2() {
  static constexpr RingKernels table = kernels("avx2");
  static const bool runs = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
                           __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("popcnt");
  return runs ? &table : nullptr;
}

}  // namespace fanstream

#else

namespace fanstream {

const RingKernels* RingKernels::avx2() { return nullptr; }

}  // namespace fanstream

#endif
