// Many counts of which hardly one is large.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace fanstream {

// An array of numbers below 2^32, at two bytes each for as long as all are below 2^16. Thread safety: like a standard
// container.
class NarrowCounts {
 public:
  void resize(std::size_t count) {
    if (wide_.empty()) {
      narrow_.resize(count);
    } else {
      wide_.resize(count);
    }
  }
  std::size_t size() const { return wide_.empty() ? narrow_.size() : wide_.size(); }
  std::uint32_t operator[](std::size_t i) const { return wide_.empty() ? narrow_[i] : wide_[i]; }
  void set(std::size_t i, std::uint32_t count) {
    if (count > 0xFFFFU && wide_.empty()) {
      wide_.assign(narrow_.begin(), narrow_.end());
      std::vector<std::uint16_t>().swap(narrow_);
    }
    if (wide_.empty()) {
      narrow_[i] = static_cast<std::uint16_t>(count);
    } else {
      wide_[i] = count;
    }
  }

 private:
  std::vector<std::uint16_t> narrow_;  // or
  std::vector<std::uint32_t> wide_;
};

}  // namespace fanstream
