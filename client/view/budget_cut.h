// Which of many things, each with a level and a cost, are given up so that the rest fits.
#pragma once

#include <cstdint>
#include <vector>

namespace fanstream {

// Scratch memory is kept between uses. Not thread safe.
class BudgetCut {
 public:
  void clear();
  void add(float level, std::uint64_t cost);  // level > 0 and finite
  std::uint64_t total_cost() const { return total_cost_; }
  // The lowest level such that what lies above it costs at most `room`: 0 if everything fits. Things of equal level
  // stay or go together. Linear in the number of things.
  float lowest_level(std::uint64_t room);

 private:
  struct Entry {
    float level = 0.0F;
    std::uint64_t cost = 0;
  };
  std::vector<Entry> entries_;
  std::vector<Entry> border_;
  std::vector<std::uint64_t> bucket_costs_;
  std::uint64_t total_cost_ = 0;
};

}  // namespace fanstream
