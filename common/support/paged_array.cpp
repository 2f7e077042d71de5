#include "common/support/paged_array.h"

#include <algorithm>
#include <cstdlib>

#include "common/support/huge_pages.h"

#if defined(__linux__)
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace fanstream {
namespace {

constexpr std::size_t kAlignment = 64;

#if defined(__linux__)
constexpr bool kGivesBack = true;
std::size_t page_bytes() {
  static const auto size = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return size;
}
void* map_pages(std::size_t size_bytes) {
  void* const at =
      mmap(nullptr, size_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  return at == MAP_FAILED ? nullptr : at;
}
void unmap_pages(void* at, std::size_t size_bytes) { munmap(at, size_bytes); }
bool give_back(std::byte* data, std::size_t size_bytes) { return madvise(data, size_bytes, MADV_DONTNEED) == 0; }
#else
constexpr bool kGivesBack = false;
constexpr std::size_t page_bytes() { return 4096; }
void* map_pages(std::size_t /*size_bytes*/) { return nullptr; }
void unmap_pages(void* /*at*/, std::size_t /*size_bytes*/) {}
bool give_back(std::byte* /*data*/, std::size_t /*size_bytes*/) { return false; }
#endif

}  // namespace

ZeroPages::ZeroPages(std::size_t size_bytes, PageKind kind) : kind_(kGivesBack ? kind : PageKind::huge) {
  if (size_bytes == 0) return;
  if (kind_ == PageKind::small) {
    block_ = map_pages(size_bytes);
    data_ = static_cast<std::byte*>(block_);
    in_use_.resize((size_bytes + page_bytes() - 1) / page_bytes());
  } else {
    block_ = std::calloc(size_bytes + kAlignment, 1);  // does not write to fresh memory
    const auto address = reinterpret_cast<std::uintptr_t>(block_);
    data_ = static_cast<std::byte*>(block_) + (kAlignment - address % kAlignment) % kAlignment;
    prefer_huge_pages(data_, size_bytes);
  }
  if (block_ == nullptr) std::abort();
  size_bytes_ = size_bytes;
}

ZeroPages::~ZeroPages() {
  if (kind_ == PageKind::small) {
    if (block_ != nullptr) unmap_pages(block_, size_bytes_);
  } else {
    std::free(block_);
  }
}

void ZeroPages::swap(ZeroPages& other) noexcept {
  std::swap(block_, other.block_);
  std::swap(data_, other.data_);
  std::swap(size_bytes_, other.size_bytes_);
  std::swap(kind_, other.kind_);
  std::swap(pages_in_use_, other.pages_in_use_);
  in_use_.swap(other.in_use_);
}

void ZeroPages::note_use(std::size_t begin, std::size_t end) {
  if (kind_ == PageKind::huge || begin >= end) return;
  for (std::size_t page = begin / page_bytes(); page <= (end - 1) / page_bytes(); ++page) {
    pages_in_use_ += in_use_[page] ? 0 : 1;
    in_use_[page] = true;
  }
}

void ZeroPages::discard(std::size_t begin, std::size_t end) {
  if (kind_ == PageKind::huge) return;
  std::size_t first = (begin + page_bytes() - 1) / page_bytes();
  std::size_t last = end == size_bytes_ ? in_use_.size() : end / page_bytes();
  while (first < last && !in_use_[first]) ++first;
  while (first < last && !in_use_[last - 1]) --last;
  if (first >= last) return;
  std::byte* const at = data_ + first * page_bytes();
  const std::size_t bytes = std::min(size_bytes_ - first * page_bytes(), (last - first) * page_bytes());
  if (!give_back(at, bytes)) return;
  for (std::size_t page = first; page < last; ++page) {
    pages_in_use_ -= in_use_[page] ? 1 : 0;
    in_use_[page] = false;
  }
}

std::size_t ZeroPages::resident_bytes() const {
  return kind_ == PageKind::huge ? size_bytes_ : pages_in_use_ * page_bytes();
}

}  // namespace fanstream
