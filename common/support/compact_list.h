// A list that costs one pointer where it is kept, for the many objects that have short ones.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace fanstream {

// Size and capacity stand before the elements, of which there are fewer than 2^32. Like std::vector otherwise, but that
// it grows by a quarter. Thread safety: like a standard container.
template <class T>
class CompactList {
  static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= 8);

 public:
  using value_type = T;
  CompactList() = default;
  CompactList(std::span<const T> values) { append(values); }       // NOLINT: lists are made of what is like one
  CompactList(const std::vector<T>& values) { append({values}); }  // NOLINT
  CompactList(const CompactList& other) { append(other); }
  CompactList(CompactList&& other) noexcept : block_(std::exchange(other.block_, nullptr)) {}
  CompactList& operator=(CompactList other) noexcept {
    std::swap(block_, other.block_);
    return *this;
  }
  ~CompactList() { ::operator delete(block_); }

  std::uint32_t size() const { return block_ == nullptr ? 0 : block_->size; }
  std::uint32_t capacity() const { return block_ == nullptr ? 0 : block_->capacity; }
  bool empty() const { return size() == 0; }
  T* data() { return block_ == nullptr ? nullptr : reinterpret_cast<T*>(block_ + 1); }
  const T* data() const { return block_ == nullptr ? nullptr : reinterpret_cast<const T*>(block_ + 1); }
  T& operator[](std::size_t i) { return data()[i]; }
  const T& operator[](std::size_t i) const { return data()[i]; }
  T& back() { return data()[size() - 1]; }
  const T& back() const { return data()[size() - 1]; }
  T* begin() { return data(); }
  T* end() { return data() + size(); }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size(); }
  operator std::span<const T>() const { return {data(), size()}; }  // NOLINT

  void push_back(const T& value) {
    const T copy = value;  // which may be an element
    if (size() == capacity()) grow(size() + std::uint32_t{1});
    data()[block_->size++] = copy;
  }
  void pop_back() {
    assert(!empty());
    --block_->size;
  }
  void reserve(std::size_t count) {
    if (count > capacity()) grow(count);
  }
  // New elements are zero bytes.
  void resize(std::size_t count) {
    const std::uint32_t before = size();
    if (count > capacity()) grow(count);
    if (block_ == nullptr) return;
    if (count > before) std::memset(static_cast<void*>(data() + before), 0, (count - before) * sizeof(T));
    block_->size = static_cast<std::uint32_t>(count);
  }
  void assign(std::span<const T> values) {  // which are not its own
    if (block_ != nullptr) block_->size = 0;
    append(values);
  }
  void append(std::span<const T> values) {  // which are not its own
    if (values.empty()) return;
    const std::uint32_t before = size();
    if (before + values.size() > capacity()) grow(before + values.size());
    std::memcpy(static_cast<void*>(data() + before), values.data(), values.size_bytes());
    block_->size = static_cast<std::uint32_t>(before + values.size());
  }
  template <class Predicate>
  void erase_if(Predicate&& is_out) {
    if (!empty()) block_->size = static_cast<std::uint32_t>(std::remove_if(begin(), end(), is_out) - begin());
  }

  // Beyond the object itself.
  std::size_t memory_bytes() const { return block_ == nullptr ? 0 : sizeof(Block) + capacity() * sizeof(T); }

 private:
  struct Block {
    std::uint32_t size = 0;
    std::uint32_t capacity = 0;
  };
  // The first elements take no more than they need; later there is room for some more. Allocators hand out multiples of
  // 16 bytes less 8 for themselves.
  void grow(std::size_t count) {
    const std::size_t wanted = std::max<std::size_t>(count, capacity() + capacity() / 4);
    const std::size_t bytes = (sizeof(Block) + wanted * sizeof(T) + 7) / 16 * 16 + 8;
    auto* const made = new (::operator new(bytes)) Block;
    made->size = size();
    made->capacity = static_cast<std::uint32_t>((bytes - sizeof(Block)) / sizeof(T));
    if (!empty()) std::memcpy(static_cast<void*>(made + 1), data(), size() * sizeof(T));
    ::operator delete(block_);
    block_ = made;
  }

  Block* block_ = nullptr;
};

}  // namespace fanstream
