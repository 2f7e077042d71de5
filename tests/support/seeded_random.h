// Random choices that are the same with every standard library.
#pragma once

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace fanstream::testing {

class SeededRandom {
 public:
  explicit SeededRandom(std::uint64_t seed) : engine_(seed) {}
  std::uint32_t below(std::size_t limit) { return static_cast<std::uint32_t>(engine_() % limit); }  // limit > 0
  std::int32_t between(std::int32_t low, std::int32_t high) {                                       // both included
    return static_cast<std::int32_t>(
        low +
        static_cast<std::int64_t>(engine_() % static_cast<std::uint64_t>(static_cast<std::int64_t>(high) - low + 1)));
  }
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }  // in [0, 1)
  bool one_in(std::uint32_t n) { return below(n) == 0; }
  template <class T>
  void shuffle(std::vector<T>& values) {
    for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[below(i)]);
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace fanstream::testing
