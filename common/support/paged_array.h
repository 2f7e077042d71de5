// Large arrays of which only the pages in use take memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace fanstream {

// How the system is to back an array: `huge` asks for huge pages, which makes first use faster but whole; with `small`
// memory is taken and given back by the page. Of an array with much in use (ZeroPages::kSmallBytes) what is used from
// then on is taken by the huge page, and given back by the small one still.
enum class PageKind : std::uint8_t { huge, small };

// Memory that reads as zero until it is written; what has not been written takes no memory where the system maps pages
// lazily (Linux; elsewhere all of it does). Not thread safe. Ends the program if there is no address space left.
class ZeroPages {
 public:
  static constexpr std::size_t kHugePageBytes = std::size_t{1} << 21U;
  // Of small pages at least so much is in use before huge ones are taken: what these waste is a fraction of it.
  static constexpr std::size_t kSmallBytes = 2 * kHugePageBytes;

  ZeroPages() = default;
  ZeroPages(std::size_t size_bytes, PageKind kind);
  ~ZeroPages();
  ZeroPages(ZeroPages&& other) noexcept { swap(other); }
  ZeroPages& operator=(ZeroPages&& other) noexcept {
    swap(other);
    return *this;
  }
  ZeroPages(const ZeroPages&) = delete;
  ZeroPages& operator=(const ZeroPages&) = delete;

  std::byte* data() const { return data_; }
  std::size_t size_bytes() const { return size_bytes_; }
  PageKind kind() const { return kind_; }
  // Says that bytes [begin, end) are written, for resident_bytes() to count.
  void note_use(std::size_t begin, std::size_t end);
  // Gives back the pages that lie in [begin, end) as a whole; they read as zero again. Does nothing to huge pages.
  void discard(std::size_t begin, std::size_t end);
  // Of the pages in use: noted and not given back, and what huge ones among them have beyond. With PageKind::huge, all.
  std::size_t resident_bytes() const;

 private:
  void swap(ZeroPages& other) noexcept;
  void note_page(std::size_t page);
  void give_back_rest(std::size_t region);
  std::size_t used_pages(std::size_t region) const;

  void* block_ = nullptr;  // as allocated
  std::size_t block_bytes_ = 0;
  std::byte* data_ = nullptr;
  std::size_t size_bytes_ = 0;
  PageKind kind_ = PageKind::huge;
  // Of PageKind::small only.
  std::size_t resident_pages_ = 0;
  std::vector<bool> in_use_;  // by page
  std::vector<bool> huge_;    // by region of kHugePageBytes that lies in the array as a whole: backed by a huge page
};

// An array over them that only grows. Elements not yet written are all zero bytes. Thread safety: like a standard
// container.
template <class T>
class PagedArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  using value_type = T;
  PagedArray() = default;
  PagedArray(PagedArray&&) noexcept = default;
  PagedArray& operator=(PagedArray&&) noexcept = default;
  PagedArray(const PagedArray& other) { *this = other; }
  PagedArray& operator=(const PagedArray& other) {
    if (this != &other) *this = copy_of(other.data(), other.size(), other.size(), other.pages_.kind());
    return *this;
  }
  explicit PagedArray(std::span<const T> values) {
    *this = copy_of(values.data(), values.size(), values.size(), PageKind::huge);
  }

  void grow(std::size_t size, PageKind kind = PageKind::huge) {
    if (size > this->size()) *this = copy_of(data(), this->size(), size, kind);
  }
  std::size_t size() const { return pages_.size_bytes() / sizeof(T); }
  T* data() { return reinterpret_cast<T*>(pages_.data()); }
  const T* data() const { return reinterpret_cast<const T*>(pages_.data()); }
  T& operator[](std::size_t i) { return data()[i]; }
  const T& operator[](std::size_t i) const { return data()[i]; }
  T* begin() { return data(); }
  T* end() { return data() + size(); }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size(); }

  // ZeroPages' by element.
  void note_use(std::size_t first, std::size_t last) { pages_.note_use(first * sizeof(T), last * sizeof(T)); }
  void discard(std::size_t first, std::size_t last) { pages_.discard(first * sizeof(T), last * sizeof(T)); }
  std::size_t resident_bytes() const { return pages_.resident_bytes(); }

 private:
  static PagedArray copy_of(const T* values, std::size_t count, std::size_t size, PageKind kind) {
    PagedArray copy;
    copy.pages_ = ZeroPages(size * sizeof(T), kind);
    if (count != 0) std::memcpy(copy.pages_.data(), values, count * sizeof(T));
    copy.note_use(0, count);
    return copy;
  }

  ZeroPages pages_;
};

}  // namespace fanstream
