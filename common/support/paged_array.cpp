#include "common/support/paged_array.h"

#include <algorithm>
#include <cstdlib>
#include <new>

#include "common/support/huge_pages.h"

#if defined(__linux__)
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace fanstream {
namespace {

#if defined(__linux__)
std::size_t page_bytes() {
  static const auto size = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return size;
}

std::byte* allocate(std::size_t size_bytes) {
  void* const at =
      mmap(nullptr, size_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  return at == MAP_FAILED ? nullptr : static_cast<std::byte*>(at);
}

void release(std::byte* data, std::size_t size_bytes) { munmap(data, size_bytes); }

bool give_back(std::byte* data, std::size_t size_bytes) { return madvise(data, size_bytes, MADV_DONTNEED) == 0; }
#else
constexpr std::size_t page_bytes() { return 4096; }
constexpr std::align_val_t kAlignment{64};
std::byte* allocate(std::size_t size_bytes) {
  void* const at = ::operator new(size_bytes, kAlignment);
  return static_cast<std::byte*>(std::memset(at, 0, size_bytes));
}
void release(std::byte* data, std::size_t /*size_bytes*/) { ::operator delete(data, kAlignment); }
bool give_back(std::byte* /*data*/, std::size_t /*size_bytes*/) { return false; }
#endif

}  // namespace

ZeroPages::ZeroPages(std::size_t size_bytes, PageKind kind) : kind_(kind) {
  if (size_bytes == 0) return;
  data_ = allocate(size_bytes);
  if (data_ == nullptr) std::abort();
  size_bytes_ = size_bytes;
  if (kind == PageKind::huge) {
    prefer_huge_pages(data_, size_bytes);
  } else {
    in_use_.resize((size_bytes + page_bytes() - 1) / page_bytes());
  }
}

ZeroPages::~ZeroPages() {
  if (data_ != nullptr) release(data_, size_bytes_);
}

void ZeroPages::swap(ZeroPages& other) noexcept {
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
