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

std::size_t to_multiple(std::uintptr_t address, std::size_t of) { return (of - address % of) % of; }

#if defined(__linux__)
constexpr bool kGivesBack = true;
std::size_t page_bytes() {
  static const auto size = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return size;
}
// Small pages, whatever the system prefers.
void* map_pages(std::size_t size_bytes) {
  void* const at =
      mmap(nullptr, size_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (at == MAP_FAILED) return nullptr;
  madvise(at, size_bytes, MADV_NOHUGEPAGE);  // fails where there are none anyway
  return at;
}
bool set_huge(std::byte* data, std::size_t size_bytes, bool huge) {
  return madvise(data, size_bytes, huge ? MADV_HUGEPAGE : MADV_NOHUGEPAGE) == 0;
}
void unmap_pages(void* at, std::size_t size_bytes) { munmap(at, size_bytes); }
bool give_back(std::byte* data, std::size_t size_bytes) { return madvise(data, size_bytes, MADV_DONTNEED) == 0; }
#else
constexpr bool kGivesBack = false;
constexpr std::size_t page_bytes() { return 4096; }
void* map_pages(std::size_t /*size_bytes*/) { return nullptr; }
void unmap_pages(void* /*at*/, std::size_t /*size_bytes*/) {}
bool set_huge(std::byte* /*data*/, std::size_t /*size_bytes*/, bool /*huge*/) { return false; }
bool give_back(std::byte* /*data*/, std::size_t /*size_bytes*/) { return false; }
#endif

}  // namespace

ZeroPages::ZeroPages(std::size_t size_bytes, PageKind kind) : kind_(kGivesBack ? kind : PageKind::huge) {
  if (size_bytes == 0) return;
  if (kind_ == PageKind::small) {
    const bool large = size_bytes > kSmallBytes;  // then it begins as a huge page does
    block_bytes_ = size_bytes + (large ? kHugePageBytes : 0);
    block_ = map_pages(block_bytes_);
    data_ = static_cast<std::byte*>(block_);
    if (large) data_ += to_multiple(reinterpret_cast<std::uintptr_t>(block_), kHugePageBytes);
    in_use_.resize((size_bytes + page_bytes() - 1) / page_bytes());
    huge_.resize(large ? size_bytes / kHugePageBytes : 0);
  } else {
    block_ = std::calloc(size_bytes + kAlignment, 1);  // does not write to fresh memory
    data_ = static_cast<std::byte*>(block_) + to_multiple(reinterpret_cast<std::uintptr_t>(block_), kAlignment);
    prefer_huge_pages(data_, size_bytes);
  }
  if (block_ == nullptr) std::abort();
  size_bytes_ = size_bytes;
}

ZeroPages::~ZeroPages() {
  if (kind_ == PageKind::small) {
    if (block_ != nullptr) unmap_pages(block_, block_bytes_);
  } else {
    std::free(block_);
  }
}

void ZeroPages::swap(ZeroPages& other) noexcept {
  std::swap(block_, other.block_);
  std::swap(block_bytes_, other.block_bytes_);
  std::swap(data_, other.data_);
  std::swap(size_bytes_, other.size_bytes_);
  std::swap(kind_, other.kind_);
  std::swap(resident_pages_, other.resident_pages_);
  in_use_.swap(other.in_use_);
  huge_.swap(other.huge_);
}

std::size_t ZeroPages::used_pages(std::size_t region) const {
  const auto begin = in_use_.begin() + static_cast<std::ptrdiff_t>(region * (kHugePageBytes / page_bytes()));
  return static_cast<std::size_t>(
      std::count(begin, begin + static_cast<std::ptrdiff_t>(kHugePageBytes / page_bytes()), true));
}

void ZeroPages::note_page(std::size_t page) {
  if (in_use_[page]) return;
  const std::size_t region = page * page_bytes() / kHugePageBytes;
  const bool whole = region < huge_.size();
  if (whole && !huge_[region] && resident_bytes() >= kSmallBytes && used_pages(region) == 0 &&
      set_huge(data_ + region * kHugePageBytes, kHugePageBytes, true)) {
    huge_[region] = true;
    resident_pages_ += kHugePageBytes / page_bytes();
  }
  if (!whole || !huge_[region]) ++resident_pages_;
  in_use_[page] = true;
}

void ZeroPages::note_use(std::size_t begin, std::size_t end) {
  if (kind_ == PageKind::huge || begin >= end) return;
  for (std::size_t page = begin / page_bytes(); page <= (end - 1) / page_bytes(); ++page) note_page(page);
}

// The region is one of small pages again, of which it has those in use.
void ZeroPages::give_back_rest(std::size_t region) {
  set_huge(data_ + region * kHugePageBytes, kHugePageBytes, false);
  huge_[region] = false;
  resident_pages_ -= kHugePageBytes / page_bytes() - used_pages(region);
  const std::size_t end = (region + 1) * (kHugePageBytes / page_bytes());
  for (std::size_t page = region * (kHugePageBytes / page_bytes()); page < end;) {
    std::size_t next = page + 1;
    while (next < end && in_use_[next] == in_use_[page]) ++next;
    if (!in_use_[page]) give_back(data_ + page * page_bytes(), (next - page) * page_bytes());
    page = next;
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
    const std::size_t region = page * page_bytes() / kHugePageBytes;
    const bool is_small = region >= huge_.size() || !huge_[region];
    if (is_small && in_use_[page]) --resident_pages_;
    in_use_[page] = false;
  }
  const std::size_t last_region = std::min(huge_.size(), (last - 1) * page_bytes() / kHugePageBytes + 1);
  for (std::size_t region = first * page_bytes() / kHugePageBytes; region < last_region; ++region) {
    if (huge_[region]) give_back_rest(region);
  }
}

std::size_t ZeroPages::resident_bytes() const {
  return kind_ == PageKind::huge ? size_bytes_ : resident_pages_ * page_bytes();
}

}  // namespace fanstream
