#include "protocol/send_plan.h"

#include <algorithm>
#include <utility>

namespace fanstream {

bool SendPlan::in_range(const CellRun& run) const {
  return std::uint64_t{run.first_cell} + run.cell_count <= source_->cell_count();
}

bool SendPlan::start(std::shared_ptr<const SegmentSource> source, std::optional<Have> have) {
  source_ = std::move(source);
  head_size_ = source_->head().size();
  index_size_ = source_->index().size();
  head_sent_ = have && have->head ? head_size_ : 0;
  index_sent_ = have && have->index ? index_size_ : 0;
  sent_.reserve(source_->cell_count());
  walk_.emplace();
  if (!have) return true;
  for (const CellRun& run : have->cells) {
    if (!in_range(run)) return false;
  }
  walk_->runs = std::move(have->cells);
  return true;
}

bool SendPlan::work(std::size_t& entry_budget) {
  if (!walk_) return true;
  for (; sent_.size() < source_->cell_count(); --entry_budget) {
    if (entry_budget == 0) return false;
    segment_total_ += source_->segment_count(static_cast<std::uint32_t>(sent_.size()));
    sent_.push_back(0);
  }
  for (; walk_->run < walk_->runs.size(); ++walk_->run, walk_->run_cell = 0) {
    const CellRun run = walk_->runs[walk_->run];
    for (; walk_->run_cell < run.cell_count; ++walk_->run_cell, --entry_budget) {
      if (entry_budget == 0) return false;
      if (set_sent(*walk_, run.first_cell + walk_->run_cell, run.prefix)) continue;
      have_is_valid_ = false;
      walk_.reset();
      return true;
    }
  }
  walk_.reset();
  return true;
}

// False if a cell stated as held has no such prefix.
bool SendPlan::set_sent(const SentWalk& walk, std::uint32_t cell, std::uint32_t prefix) {
  if (walk.release) {
    sent_[cell] = static_cast<std::uint16_t>(std::min<std::uint32_t>(sent_[cell], prefix));
    return true;
  }
  const std::uint32_t count = source_->segment_count(cell);
  if (prefix != kAllSegments && prefix > count) return false;
  sent_[cell] = static_cast<std::uint16_t>(std::min(prefix, count));
  return true;
}

void SendPlan::set_wants(std::uint32_t epoch, std::vector<CellRun> runs) {
  epoch_ = epoch;
  runs_ = std::move(runs);
  run_ = 0;
  run_cell_ = 0;
  done_pending_ = true;
}

bool SendPlan::release(std::vector<CellRun> runs) {
  ++release_count_;
  const auto beyond = std::find_if(runs.begin(), runs.end(), [this](const CellRun& run) { return !in_range(run); });
  const bool all = beyond == runs.end();
  runs.erase(beyond, runs.end());
  walk_.emplace();
  walk_->runs = std::move(runs);
  walk_->release = true;
  return all;
}

SendPlan::Next SendPlan::next(std::uint64_t credit_bytes, std::size_t& entry_budget, DataFrame& frame) {
  if (!source_) return Next::idle;
  if (walk_) return Next::out_of_work;
  frame = {};
  frame.release_count = release_count_;
  if (head_sent_ < head_size_ || index_sent_ < index_size_) {
    return give_blob(credit_bytes, frame) ? Next::frame : Next::no_credit;
  }
  if (part_) {
    const Bytes whole = source_->segment(part_->cell, part_->segment);
    if (std::min<std::size_t>(kMaxChunkBytes, whole.size() - part_->offset_bytes) > credit_bytes)
      return Next::no_credit;
    give_part(*part_, whole, frame);
    return Next::frame;
  }
  return next_wanted(credit_bytes, entry_budget, frame);
}

bool SendPlan::give_blob(std::uint64_t credit_bytes, DataFrame& frame) {
  const bool head = head_sent_ < head_size_;
  std::uint64_t& sent = head ? head_sent_ : index_sent_;
  const Bytes blob = head ? source_->head() : source_->index();
  const std::size_t size = std::min<std::size_t>(kMaxChunkBytes, blob.size() - sent);
  if (size > credit_bytes) return false;
  frame.type = head ? FrameType::head_data : FrameType::index_data;
  frame.offset_bytes = static_cast<std::uint32_t>(sent);
  frame.blob = blob.subspan(static_cast<std::size_t>(sent), size);
  frame.size_bytes = size;
  sent += size;
  return true;
}

void SendPlan::give_part(const OpenSegment& part, Bytes whole, DataFrame& frame) {
  frame.type = FrameType::segment_part;
  frame.cells = {{part.cell, part.segment, 1}};
  frame.offset_bytes = part.offset_bytes;
  frame.blob = whole.subspan(part.offset_bytes, std::min(kMaxChunkBytes, whole.size() - part.offset_bytes));
  frame.size_bytes = frame.blob.size();
  const std::size_t end = part.offset_bytes + frame.blob.size();
  if (end < whole.size()) {
    part_ = OpenSegment{part.cell, part.segment, static_cast<std::uint32_t>(end)};
  } else {
    part_.reset();
    frame.finished_segments = 1;
  }
}

// Adds segments of the cell below `end` to the frame. Nothing: all of them are in it and it takes more.
std::optional<SendPlan::Next> SendPlan::add_wanted(std::uint32_t cell, std::uint32_t end, std::uint64_t credit_bytes,
                                                   DataFrame& frame) {
  bool begun = false;  // the frame's last entry is of this cell
  for (std::uint32_t segment = sent_[cell]; segment < end; ++segment) {
    const Bytes whole = source_->segment(cell, segment);
    if (whole.empty()) continue;
    const bool first = frame.cells.empty();
    if (whole.size() > kMaxSegmentBytes) return first ? Next::too_large : Next::frame;
    if (std::min(kMaxChunkBytes, whole.size()) > credit_bytes - frame.size_bytes)
      return first ? Next::no_credit : Next::frame;
    if (!first && frame.size_bytes + whole.size() > kBatchBytes) return Next::frame;
    sent_[cell] = static_cast<std::uint16_t>(segment + 1);
    if (whole.size() > kMaxChunkBytes) {
      give_part({cell, segment, 0}, whole, frame);
      return Next::frame;
    }
    if (!begun) frame.cells.push_back({cell, segment, 0});
    begun = true;
    ++frame.cells.back().count;
    ++frame.finished_segments;
    frame.size_bytes += whole.size();
    if (whole.size() > kBatchBytes) frame.blob = whole;  // alone, so it need not be copied
    if (frame.size_bytes >= kBatchBytes) return Next::frame;
  }
  return std::nullopt;
}

SendPlan::Next SendPlan::next_wanted(std::uint64_t credit_bytes, std::size_t& entry_budget, DataFrame& frame) {
  for (; run_ < runs_.size(); ++run_, run_cell_ = 0) {
    const CellRun run = runs_[run_];
    if (!in_range(run)) {
      if (!frame.cells.empty()) return Next::frame;
      return drop_wants(), Next::out_of_range;
    }
    for (; run_cell_ < run.cell_count; ++run_cell_) {
      if (entry_budget == 0) return frame.cells.empty() ? Next::out_of_work : Next::frame;
      --entry_budget;
      const std::uint32_t cell = run.first_cell + run_cell_;
      const std::uint32_t count = std::min(source_->segment_count(cell), kMaxSegmentsPerCell);
      const std::optional<Next> stop = add_wanted(cell, std::min(run.prefix, count), credit_bytes, frame);
      if (stop) return *stop;
    }
  }
  if (!frame.cells.empty()) return Next::frame;
  if (!done_pending_) return Next::idle;
  done_pending_ = false;
  return Next::wants_done;
}

bool SendPlan::take_back(const DataFrame& frame) {
  if (frame.type == FrameType::head_data || frame.type == FrameType::index_data) return false;
  if (frame.type == FrameType::segment_part) {
    part_.reset();
    if (frame.offset_bytes > 0) {
      part_ = OpenSegment{frame.cells[0].cell, frame.cells[0].first, frame.offset_bytes};
      return true;
    }
  }
  for (const ChosenSegments& chosen : frame.cells) {
    sent_[chosen.cell] = std::min(sent_[chosen.cell], static_cast<std::uint16_t>(chosen.first));
  }
  return true;
}

}  // namespace fanstream
