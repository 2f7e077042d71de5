// Cells in the order in which they are refined together.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace fanstream {

// Cells by the generation that they take next, the coarsest first; within one, first in, first out. Keeps memory for
// one generation's cells. Not thread safe.
class GenerationQueue {
 public:
  bool empty() const { return size_ == 0; }
  void push(std::uint32_t cell, std::uint32_t generation) {
    if (generation >= lines_.size()) lines_.resize(generation + std::size_t{1});
    std::vector<std::uint32_t>& cells = lines_[generation].cells;
    if (cells.empty()) cells.swap(spare_);
    cells.push_back(cell);
    if (size_++ == 0 || generation < coarsest_) coarsest_ = generation;
  }

  // Of what comes next; none of these may be called of an empty queue.
  std::uint32_t generation() const { return coarsest_; }
  std::size_t in_line() const { return next().cells.size() - next().begin; }        // cells of that generation
  std::uint32_t at(std::size_t i) const { return next().cells[next().begin + i]; }  // of these
  std::uint32_t front() const { return at(0); }
  void pop() {
    assert(!empty());
    Line& line = lines_[coarsest_];
    --size_;
    if (++line.begin < line.cells.size()) return;
    if (line.cells.capacity() > spare_.capacity()) spare_.swap(line.cells);
    spare_.clear();
    line = {};
    while (size_ != 0 && lines_[coarsest_].cells.empty()) ++coarsest_;
  }

  std::size_t memory_bytes() const {
    std::size_t bytes = lines_.capacity() * sizeof(Line) + spare_.capacity() * sizeof(std::uint32_t);
    for (const Line& line : lines_) bytes += line.cells.capacity() * sizeof(std::uint32_t);
    return bytes;
  }

 private:
  struct Line {
    std::vector<std::uint32_t> cells;
    std::size_t begin = 0;  // those before it have gone
  };
  const Line& next() const { return lines_[coarsest_]; }

  std::vector<Line> lines_;  // by generation
  std::vector<std::uint32_t> spare_;
  std::uint32_t coarsest_ = 0;
  std::size_t size_ = 0;
};

}  // namespace fanstream
