// Large arrays on large pages, where the system has them.
#pragma once

#include <cstddef>
#include <vector>

namespace fanstream {

// Asks the system to back memory that nobody has touched yet by huge pages: fewer page faults, and fewer misses where it is
// read all over the place. Small ranges are left alone. Does nothing where there is no such thing.
void prefer_huge_pages(const void* begin, std::size_t size_bytes);

// Resizes like std::vector, new memory on huge pages if it is large enough.
template <class T>
void resize_large(std::vector<T>& array, std::size_t size) {
  if (size > array.capacity()) {
    array.reserve(size);
    prefer_huge_pages(array.data() + array.size(), (size - array.size()) * sizeof(T));
  }
  array.resize(size);
}

}  // namespace fanstream
