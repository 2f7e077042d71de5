// Many counts of which hardly one is large.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/support/paged_array.h"

namespace fanstream {

// An array of numbers below 2^32, 0 at first, at two bytes each for as long as all are below 2^16; pages of memory in
// which none has been set take none. Thread safety: like a standard container.
class NarrowCounts {
 public:
  NarrowCounts() = default;
  explicit NarrowCounts(std::size_t count) { narrow_.grow(count, PageKind::small); }
  std::size_t size() const { return is_wide() ? wide_.size() : narrow_.size(); }
  std::uint32_t operator[](std::size_t i) const { return is_wide() ? wide_[i] : narrow_[i]; }
  void set(std::size_t i, std::uint32_t count) {
    if (count > 0xFFFFU && !is_wide()) {
      wide_.grow(narrow_.size(), PageKind::small);
      for (std::size_t k = 0; k < narrow_.size(); ++k) {
        if (narrow_[k] != 0) wide_[k] = narrow_[k];
      }
      narrow_ = PagedArray<std::uint16_t>();
    }
    if (!is_wide()) {
      narrow_[i] = static_cast<std::uint16_t>(count);
    } else {
      wide_[i] = count;
    }
  }

 private:
  bool is_wide() const { return wide_.size() != 0; }
  PagedArray<std::uint16_t> narrow_;  // or
  PagedArray<std::uint32_t> wide_;
};

}  // namespace fanstream
