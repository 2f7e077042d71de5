// Which places of an array of faces are taken, where faces lie wherever there is room.
#pragma once

#include <cstdint>
#include <vector>

namespace fanstream {

// Hands out rooms by number, kPerPage to a page: those of pages in use first, so that few are. Not thread safe.
class FaceRooms {
 public:
  static constexpr std::uint32_t kPerPage = 16;

  struct Taken {
    std::uint32_t room = 0;
    bool opens_page = false;  // no other room of its page is taken
  };
  // Some free room. There are never more pages than the most rooms taken at once fill.
  Taken take();
  // Precondition: it is taken.
  void leave(std::uint32_t room);
  // The pages that have become empty since the last call and still are, in no order.
  std::vector<std::uint32_t> take_emptied_pages();
  std::size_t memory_bytes() const;

 private:
  static constexpr std::uint16_t kFull = 0xFFFF;
  struct Page {
    std::uint16_t taken = 0;  // bit by room
    bool listed = false;      // in open_
  };
  std::vector<Page> pages_;
  std::vector<std::uint32_t> open_;   // that may have room, those that were in use when last looked at
  std::vector<std::uint32_t> empty_;  // all their rooms are free, and nobody holds them
  bool left_ = false;                 // a room since pages were last looked at
};

}  // namespace fanstream
