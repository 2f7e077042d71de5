// Eight lanes as two vectors of four, for machines of any kind: what ring_kernels.inc is written in. Included by
// ring_kernels.cpp alone, inside its namespace.

struct Float8 {
  Float4 low{};
  Float4 high{};
};
struct Uint8 {
  Uint4 low{};
  Uint4 high{};
};

inline Float8 operator+(Float8 a, Float8 b) { return {a.low + b.low, a.high + b.high}; }
inline Float8 operator-(Float8 a, Float8 b) { return {a.low - b.low, a.high - b.high}; }
inline Float8 operator*(Float8 a, Float8 b) { return {a.low * b.low, a.high * b.high}; }
inline Float8 operator/(Float8 a, Float8 b) { return {a.low / b.low, a.high / b.high}; }
inline Uint8 operator+(Uint8 a, Uint8 b) { return {a.low + b.low, a.high + b.high}; }
inline Uint8 operator-(Uint8 a, Uint8 b) { return {a.low - b.low, a.high - b.high}; }
inline Uint8 operator&(Uint8 a, Uint8 b) { return {a.low & b.low, a.high & b.high}; }
inline Uint8 operator|(Uint8 a, Uint8 b) { return {a.low | b.low, a.high | b.high}; }
inline Uint8 operator~(Uint8 a) { return {~a.low, ~a.high}; }

inline Float8 all8(float v) { return {float4(v), float4(v)}; }
inline Uint8 all8(std::uint32_t v) { return {uint4(v), uint4(v)}; }
inline Uint8 lanes_from8(std::uint32_t first) { return {kLaneNumbers + uint4(first), kLaneNumbers + uint4(first + 4)}; }
inline Float8 load8(const float* from) { return {load4(from), load4(from + 4)}; }
inline Uint8 load8(const std::uint32_t* from) { return {load4(from), load4(from + 4)}; }
inline void store8(float* to, Float8 v) {
  store4(to, v.low);
  store4(to + 4, v.high);
}
inline void store8(std::uint32_t* to, Uint8 v) {
  store4(to, v.low);
  store4(to + 4, v.high);
}

// Comparisons give masks. Of whole numbers below 2^31.
inline Uint8 less8(Uint8 a, Uint8 b) { return {less(a.low, b.low), less(a.high, b.high)}; }
inline Uint8 equal8(Uint8 a, Uint8 b) { return {mask_of(a.low == b.low), mask_of(a.high == b.high)}; }
inline Uint8 equal8(Float8 a, Float8 b) { return {mask_of(a.low == b.low), mask_of(a.high == b.high)}; }
inline Uint8 chosen8(Uint8 mask, Uint8 yes, Uint8 no) { return (mask & yes) | (~mask & no); }
inline Float8 chosen8(Uint8 mask, Float8 yes, Float8 no) {
  return {chosen(mask.low, yes.low, no.low), chosen(mask.high, yes.high, no.high)};
}
inline Float8 masked8(Uint8 mask, Float8 v) {
  return {std::bit_cast<Float4>(mask.low & std::bit_cast<Uint4>(v.low)),
          std::bit_cast<Float4>(mask.high & std::bit_cast<Uint4>(v.high))};
}
// A bit for every lane whose mask is set, the first lane's lowest.
inline std::uint32_t bits8(Uint8 mask) {
  return any_bits((mask.low & Uint4{1, 2, 4, 8}) | (mask.high & Uint4{16, 32, 64, 128}));
}
inline Uint8 lanes_of8(Float8 v) { return {std::bit_cast<Uint4>(v.low), std::bit_cast<Uint4>(v.high)}; }
inline Float8 floats_of8(Uint8 v) { return {std::bit_cast<Float4>(v.low), std::bit_cast<Float4>(v.high)}; }
inline Uint8 truncated8(Float8 v) {
  return {std::bit_cast<Uint4>(__builtin_convertvector(v.low, Int4)),
          std::bit_cast<Uint4>(__builtin_convertvector(v.high, Int4))};
}
inline Float8 to_float8(Uint8 v) {  // of signed numbers
  return {to_float4(std::bit_cast<Int4>(v.low)), to_float4(std::bit_cast<Int4>(v.high))};
}
inline Uint8 above8(Float8 a, Float8 b) { return {mask_of(a.low > b.low), mask_of(a.high > b.high)}; }
inline Float8 larger8(Float8 a, Float8 b) { return {a.low > b.low ? a.low : b.low, a.high > b.high ? a.high : b.high}; }
inline Float8 smaller8(Float8 a, Float8 b) {
  return {a.low < b.low ? a.low : b.low, a.high < b.high ? a.high : b.high};
}
inline float largest8(Float8 v) {
  Float4 most = v.low > v.high ? v.low : v.high;
  const Float4 other = __builtin_shufflevector(most, most, 2, 3, 0, 1);
  most = most > other ? most : other;
  return most[0] > most[1] ? most[0] : most[1];
}

// Eight rows of four, component by component. The rows are aligned to 16 bytes.
struct Rows8 {
  Uint8 x, y, z, w;
};
inline void turn_four(const void* const* rows, Uint4& x, Uint4& y, Uint4& z, Uint4& w) {
  const auto row = [&](std::size_t i) { return load4(static_cast<const std::uint32_t*>(rows[i])); };
  const Uint4 a = row(0);
  const Uint4 b = row(1);
  const Uint4 c = row(2);
  const Uint4 d = row(3);
  const Uint4 xy_ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const Uint4 xy_cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const Uint4 zw_ab = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Uint4 zw_cd = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  x = __builtin_shufflevector(xy_ab, xy_cd, 0, 1, 4, 5);
  y = __builtin_shufflevector(xy_ab, xy_cd, 2, 3, 6, 7);
  z = __builtin_shufflevector(zw_ab, zw_cd, 0, 1, 4, 5);
  w = __builtin_shufflevector(zw_ab, zw_cd, 2, 3, 6, 7);
}
inline Rows8 turned8(const void* const (&rows)[8]) {
  Rows8 turned;
  turn_four(rows, turned.x.low, turned.y.low, turned.z.low, turned.w.low);
  turn_four(rows + 4, turned.x.high, turned.y.high, turned.z.high, turned.w.high);
  return turned;
}
template <int count>
Uint8 shifted_right8(Uint8 v) {
  return {v.low >> static_cast<std::uint32_t>(count), v.high >> static_cast<std::uint32_t>(count)};
}

// The lanes moved up by one, below them `first`.
inline Float8 moved_up8(Float8 v, float first) {
  const Float4 f = float4(first);
  return {__builtin_shufflevector(f, v.low, 0, 4, 5, 6), __builtin_shufflevector(v.low, v.high, 3, 4, 5, 6)};
}

// Sums of the lanes up to each, with what comes before the first; in the order of CODING.md, section 3.
inline Float4 running_four(Float4 v) {
  const Float4 zero{};
  v += __builtin_shufflevector(zero, v, 0, 4, 5, 6);
  return v + __builtin_shufflevector(zero, v, 0, 1, 4, 5);
}
inline Float8 running_sums8(Float8 v, float before) {
  const Float4 low = running_four(v.low) + float4(before);
  return {low, running_four(v.high) + __builtin_shufflevector(low, low, 3, 3, 3, 3)};
}

// All lanes of each of four: ((0 + 1) + (2 + 3)) + ((4 + 5) + (6 + 7)).
inline Float4 pair_sums(Float4 a, Float4 b) {
  return __builtin_shufflevector(a, b, 0, 2, 4, 6) + __builtin_shufflevector(a, b, 1, 3, 5, 7);
}
inline Float4 sums8(Float8 a, Float8 b, Float8 c, Float8 d) {
  return pair_sums(pair_sums(a.low, b.low), pair_sums(c.low, d.low)) +
         pair_sums(pair_sums(a.high, b.high), pair_sums(c.high, d.high));
}

// One bit for each age below 64 of the lanes whose mask is set.
inline std::uint64_t age_bits8(Uint8 ages, Uint8 mask) {
  std::uint64_t bits = 0;
  const auto add = [&bits](Uint4 of, Uint4 where) {
    for (int i = 0; i < 4; ++i)
      bits |= static_cast<std::uint64_t>(of[i] < 64) << (of[i] & 63U) & (std::uint64_t{0} - (where[i] & 1U));
  };
  add(ages.low, mask.low);
  add(ages.high, mask.high);
  return bits;
}

using LaneBits = PlainBits;
