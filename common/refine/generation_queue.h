// Cells in the order in which they are refined together.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace fanstream {

// Cells by the generation that they take next, the coarsest first, and first in, first out within one. Not thread safe.
class GenerationQueue {
 public:
  bool empty() const { return size_ == 0; }
  void push(std::uint32_t cell, std::uint32_t generation) {
    if (generation >= lines_.size()) lines_.resize(generation + 1);
    lines_[generation].cells.push_back(cell);
    if (size_++ == 0 || generation < coarsest_) coarsest_ = generation;
  }
  // Of the cells that come next. Precondition: !empty().
  std::uint32_t generation() const { return coarsest_; }
  std::uint32_t front() const { return lines_[coarsest_].cells[lines_[coarsest_].begin]; }
  // Whether the one after the next `count` takes the same generation; if so, it.
  std::size_t in_line() const { return lines_[coarsest_].cells.size() - lines_[coarsest_].begin; }
  std::uint32_t at(std::size_t i) const { return lines_[coarsest_].cells[lines_[coarsest_].begin + i]; }
  void pop() {
    assert(!empty());
    Line& line = lines_[coarsest_];
    --size_;
    if (++line.begin < line.cells.size()) return;
    line.cells.clear();
    line.begin = 0;
    while (size_ != 0 && lines_[coarsest_].cells.empty()) ++coarsest_;
  }
  std::size_t memory_bytes() const {
    std::size_t bytes = lines_.capacity() * sizeof(lines_[0]);
    for (const Line& line : lines_) bytes += line.cells.capacity() * sizeof(std::uint32_t);
    return bytes;
  }

 private:
  struct Line {
    std::vector<std::uint32_t> cells;
    std::size_t begin = 0;
  };
  std::vector<Line> lines_;  // by generation
  std::uint32_t coarsest_ = 0;
  std::size_t size_ = 0;
};

}  // namespace fanstream
