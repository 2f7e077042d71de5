// What a server session has yet to send of one model: head, index, then the segments of the current list of wants. It
// chooses late and takes back what it chose but what never reached the transport when a new list arrives. No I/O.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/asset/segment_source.h"
#include "protocol/messages.h"

namespace fanstream {

// Segments of one cell in a frame of whole segments: `count` that have bytes, from `first` on.
struct ChosenSegments {
  std::uint32_t cell = 0;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

// One data frame to be sent. `blob` lies in the source. Without it, the frame joins small segments.
struct DataFrame {
  FrameType type = FrameType::segments;
  std::vector<ChosenSegments> cells;  // of segments, in order; of a segment part, the one segment
  std::uint32_t offset_bytes = 0;     // of head, index and segment part
  Bytes blob;
  std::size_t size_bytes = 0;  // of all blobs in it, which is what it costs of the credit
  std::uint32_t release_count = 0;
  std::uint32_t finished_segments = 0;  // that are whole with this frame
};

// Cells whose sent prefixes change, and how far that has come. Not within the class: as part of that it could not be
// made in place yet, says clang.
struct SentWalk {
  std::vector<CellRun> runs;
  bool release = false;  // else: held from before
  std::size_t run = 0;
  std::uint32_t run_cell = 0;
};

class SendPlan {
 public:
  // What stops the plan from giving a frame right now.
  enum class Next {
    frame,         // one was given
    no_credit,     // there is one, but it is larger than the credit
    wants_done,    // the list has just been served completely: say so (given once per list)
    idle,          // nothing to do
    out_of_work,   // the budget of looked-at entries is used up; ask again
    out_of_range,  // the list names a cell that the model has not; the list is dropped
    too_large,     // the asset holds a segment beyond kMaxSegmentBytes
  };

  // Begins with a source. `have` must be of it. False if it names cells that the source has not. Everything else is
  // work().
  bool start(std::shared_ptr<const SegmentSource> source, std::optional<Have> have);
  const SegmentSource* source() const { return source_.get(); }
  // Walks through the cells of start() and release(), as far as the budget of entries goes. True if all is done; until
  // then nothing is chosen, and neither lists nor releases may be given.
  bool work(std::size_t& entry_budget);
  bool has_cells_to_walk() const { return walk_.has_value(); }
  // After work(): whether `have` named no prefix that its cell has not.
  bool have_is_valid() const { return have_is_valid_; }
  std::uint64_t segment_total() const { return segment_total_; }

  // Replaces the list. The caller first takes back what it holds unsent (take_back).
  void set_wants(std::uint32_t epoch, std::vector<CellRun> runs);
  std::uint32_t epoch() const { return epoch_; }
  // The rest is work(). False if a run is out of range; those before it are released.
  bool release(std::vector<CellRun> runs);
  std::uint32_t release_count() const { return release_count_; }

  // The next frame if it fits into `credit_bytes`.
  Next next(std::uint64_t credit_bytes, std::size_t& entry_budget, DataFrame& frame);
  // Un-chooses a frame given by next() of which nothing was sent. Frames must come back newest first. False for head
  // and index, which are sent all the same; a segment whose first part has gone out will be finished.
  bool take_back(const DataFrame& frame);
  void drop_wants() { runs_.clear(), run_ = 0, done_pending_ = false; }

  // Something might be sent, given credit: not known for certain before next() has looked through the list.
  bool has_work() const {
    return source_ && (walk_ || head_sent_ < head_size_ || index_sent_ < index_size_ || part_ || run_ < runs_.size() ||
                       done_pending_);
  }

 private:
  struct OpenSegment {
    std::uint32_t cell, segment, offset_bytes;
  };
  bool in_range(const CellRun& run) const;
  bool set_sent(const SentWalk& walk, std::uint32_t cell, std::uint32_t prefix);
  bool give_blob(std::uint64_t credit_bytes, DataFrame& frame);
  void give_part(const OpenSegment& part, Bytes whole, DataFrame& frame);
  Next next_wanted(std::uint64_t credit_bytes, std::size_t& entry_budget, DataFrame& frame);
  std::optional<Next> add_wanted(std::uint32_t cell, std::uint32_t end, std::uint64_t credit_bytes, DataFrame& frame);

  std::shared_ptr<const SegmentSource> source_;
  std::uint64_t head_size_ = 0, head_sent_ = 0;
  std::uint64_t index_size_ = 0, index_sent_ = 0;
  std::vector<std::uint16_t> sent_;  // per cell: how many segments were chosen, or are held by the client
  std::optional<SentWalk> walk_;
  bool have_is_valid_ = true;
  std::uint64_t segment_total_ = 0;
  std::uint32_t release_count_ = 0;
  std::optional<OpenSegment> part_;  // a segment of several parts that has begun
  std::vector<CellRun> runs_;
  std::size_t run_ = 0;         // where in the list we are
  std::uint32_t run_cell_ = 0;  // cells of that run which are served
  std::uint32_t epoch_ = 0;
  bool done_pending_ = false;
};

}  // namespace fanstream
