#include "common/fans/face_rooms.h"

#include <bit>

namespace fanstream {

FaceRooms::Taken FaceRooms::take() {
  while (!open_.empty() && pages_[open_.back()].taken == kFull) {
    pages_[open_.back()].listed = false;
    open_.pop_back();
  }
  if (open_.empty()) {
    if (empty_.empty()) {
      empty_.push_back(static_cast<std::uint32_t>(pages_.size()));
      pages_.emplace_back();
    }
    open_.push_back(empty_.back());
    empty_.pop_back();
    pages_[open_.back()].listed = true;
  }
  Page& page = pages_[open_.back()];
  const auto first = static_cast<std::uint32_t>(std::countr_one(page.taken));
  const bool opens_page = page.taken == 0;
  page.taken = static_cast<std::uint16_t>(page.taken | 1U << first);
  return {open_.back() * kPerPage + first, opens_page};
}

void FaceRooms::leave(std::uint32_t room) {
  Page& page = pages_[room / kPerPage];
  page.taken = static_cast<std::uint16_t>(page.taken & ~(1U << room % kPerPage));
  left_ = true;
  if (page.listed) return;
  page.listed = true;
  open_.push_back(room / kPerPage);
}

std::vector<std::uint32_t> FaceRooms::take_emptied_pages() {
  std::vector<std::uint32_t> emptied;
  if (!left_) return emptied;
  left_ = false;
  std::size_t kept = 0;
  for (const std::uint32_t page : open_) {
    if (pages_[page].taken != 0) {
      open_[kept++] = page;
      continue;
    }
    pages_[page].listed = false;
    emptied.push_back(page);
  }
  open_.resize(kept);
  empty_.insert(empty_.end(), emptied.begin(), emptied.end());
  return emptied;
}

std::size_t FaceRooms::memory_bytes() const {
  return pages_.capacity() * sizeof(Page) + (open_.capacity() + empty_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace fanstream
