// Eight lanes as AVX2 has them: the same functions as in lanes8_portable.h, which computes the same bits. Included by
// ring_kernels_avx2.cpp alone, inside its namespace.

using Float8 = __m256;
using Uint8 = std::uint32_t __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));

FANSTREAM_LANES Float8 all8(float v) { return _mm256_set1_ps(v); }
FANSTREAM_LANES Uint8 all8(std::uint32_t v) { return Uint8{v, v, v, v, v, v, v, v}; }
FANSTREAM_LANES Uint8 lanes_from8(std::uint32_t first) { return Uint8{0, 1, 2, 3, 4, 5, 6, 7} + all8(first); }
FANSTREAM_LANES Float8 load8(const float* from) { return _mm256_loadu_ps(from); }
FANSTREAM_LANES Uint8 load8(const std::uint32_t* from) {
  return (Uint8)_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
}
FANSTREAM_LANES void store8(float* to, Float8 v) { _mm256_storeu_ps(to, v); }
FANSTREAM_LANES void store8(std::uint32_t* to, Uint8 v) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), (__m256i)v);
}

FANSTREAM_LANES Uint8 less8(Uint8 a, Uint8 b) { return (Uint8)((Int8)a < (Int8)b); }
FANSTREAM_LANES Uint8 equal8(Uint8 a, Uint8 b) { return (Uint8)(a == b); }
FANSTREAM_LANES Uint8 equal8(Float8 a, Float8 b) { return (Uint8)_mm256_cmp_ps(a, b, _CMP_EQ_OQ); }
FANSTREAM_LANES Uint8 chosen8(Uint8 mask, Uint8 yes, Uint8 no) {
  return (Uint8)_mm256_blendv_epi8((__m256i)no, (__m256i)yes, (__m256i)mask);
}
FANSTREAM_LANES Float8 chosen8(Uint8 mask, Float8 yes, Float8 no) { return _mm256_blendv_ps(no, yes, (__m256)mask); }
FANSTREAM_LANES Float8 masked8(Uint8 mask, Float8 v) { return _mm256_and_ps((__m256)mask, v); }
FANSTREAM_LANES std::uint32_t bits8(Uint8 mask) { return static_cast<std::uint32_t>(_mm256_movemask_ps((__m256)mask)); }
FANSTREAM_LANES Uint8 lanes_of8(Float8 v) { return (Uint8)v; }
FANSTREAM_LANES Float8 floats_of8(Uint8 v) { return (Float8)v; }
FANSTREAM_LANES Uint8 truncated8(Float8 v) { return (Uint8)_mm256_cvttps_epi32(v); }
FANSTREAM_LANES Float8 to_float8(Uint8 v) { return _mm256_cvtepi32_ps((__m256i)v); }
FANSTREAM_LANES Uint8 above8(Float8 a, Float8 b) { return (Uint8)_mm256_cmp_ps(a, b, _CMP_GT_OQ); }
FANSTREAM_LANES Float8 larger8(Float8 a, Float8 b) {
  return _mm256_max_ps(a, b);
}  // b where they are equal or no numbers
FANSTREAM_LANES Float8 smaller8(Float8 a, Float8 b) { return _mm256_min_ps(a, b); }
FANSTREAM_LANES float largest8(Float8 v) {
  __m128 most = _mm_max_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
  most = _mm_max_ps(most, _mm_movehl_ps(most, most));
  return _mm_cvtss_f32(_mm_max_ss(most, _mm_movehdup_ps(most)));
}

struct Rows8 {
  Uint8 x, y, z, w;
};
FANSTREAM_LANES __m256i two_rows(const void* low, const void* high) {
  const __m128i first = _mm_load_si128(static_cast<const __m128i*>(low));
  const __m128i second = _mm_load_si128(static_cast<const __m128i*>(high));
  return _mm256_inserti128_si256(_mm256_castsi128_si256(first), second, 1);
}
FANSTREAM_LANES Rows8 turned8(const void* const (&rows)[8]) {
  const __m256i a = two_rows(rows[0], rows[4]);
  const __m256i b = two_rows(rows[1], rows[5]);
  const __m256i c = two_rows(rows[2], rows[6]);
  const __m256i d = two_rows(rows[3], rows[7]);
  const __m256i xy_ab = _mm256_unpacklo_epi32(a, b);
  const __m256i xy_cd = _mm256_unpacklo_epi32(c, d);
  const __m256i zw_ab = _mm256_unpackhi_epi32(a, b);
  const __m256i zw_cd = _mm256_unpackhi_epi32(c, d);
  return {(Uint8)_mm256_unpacklo_epi64(xy_ab, xy_cd), (Uint8)_mm256_unpackhi_epi64(xy_ab, xy_cd),
          (Uint8)_mm256_unpacklo_epi64(zw_ab, zw_cd), (Uint8)_mm256_unpackhi_epi64(zw_ab, zw_cd)};
}
template <int count>
FANSTREAM_LANES Uint8 shifted_right8(Uint8 v) {
  return v >> static_cast<std::uint32_t>(count);
}

FANSTREAM_LANES Float8 moved_up8(Float8 v, float first) {
  const __m256i up = _mm256_setr_epi32(0, 0, 1, 2, 3, 4, 5, 6);
  return _mm256_blend_ps(_mm256_permutevar8x32_ps(v, up), _mm256_set1_ps(first), 1);
}

FANSTREAM_LANES Float8 running_sums8(Float8 v, float before) {
  v = v + (Float8)_mm256_slli_si256((__m256i)v, 4);
  v = v + (Float8)_mm256_slli_si256((__m256i)v, 8);
  const __m128 low = _mm_add_ps(_mm256_castps256_ps128(v), _mm_set1_ps(before));
  const __m128 high = _mm_add_ps(_mm256_extractf128_ps(v, 1), _mm_shuffle_ps(low, low, 0xFF));
  return _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
}

FANSTREAM_LANES Float4 sums8(Float8 a, Float8 b, Float8 c, Float8 d) {
  const __m256 sums = _mm256_hadd_ps(_mm256_hadd_ps(a, b), _mm256_hadd_ps(c, d));
  return (Float4)_mm_add_ps(_mm256_castps256_ps128(sums), _mm256_extractf128_ps(sums, 1));
}

FANSTREAM_LANES std::uint64_t age_bits8(Uint8 ages, Uint8 mask) {
  const __m256i of = (__m256i)(ages | ~mask);  // shifts by 64 and more give nothing
  const __m256i one = _mm256_set1_epi64x(1);
  const __m256i low = _mm256_sllv_epi64(one, _mm256_cvtepu32_epi64(_mm256_castsi256_si128(of)));
  const __m256i high = _mm256_sllv_epi64(one, _mm256_cvtepu32_epi64(_mm256_extracti128_si256(of, 1)));
  const __m256i four = _mm256_or_si256(low, high);
  const __m128i two = _mm_or_si128(_mm256_castsi256_si128(four), _mm256_extracti128_si256(four, 1));
  return static_cast<std::uint64_t>(_mm_cvtsi128_si64(_mm_or_si128(two, _mm_unpackhi_epi64(two, two))));
}

struct LaneBits {
  FANSTREAM_KERNEL static inline std::uint32_t count(std::uint64_t v) {
    return static_cast<std::uint32_t>(_mm_popcnt_u64(v));
  }
  FANSTREAM_KERNEL static inline std::uint32_t place_of(std::uint64_t v, std::uint32_t rank) {
    return static_cast<std::uint32_t>(_tzcnt_u64(_pdep_u64(std::uint64_t{1} << (rank & 63U), v)));
  }
};
