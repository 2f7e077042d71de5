#include "protocol/send_plan.h"

#include <algorithm>
#include <array>

namespace fanstream {

bool SendPlan::in_range(const CellRun& run) const {
  return std::uint64_t{run.first_cell} + run.cell_count <= source_->cell_count();
}

bool SendPlan::start(std::shared_ptr<const SegmentSource> source, const Have* have) {
  source_ = std::move(source);
  head_size_ = source_->head().size();
  index_size_ = source_->index().size();
  head_sent_ = have != nullptr && have->head ? head_size_ : 0;
  index_sent_ = have != nullptr && have->index ? index_size_ : 0;
  sent_.assign(source_->cell_count(), 0);
  if (have == nullptr) return true;
  for (const CellRun& run : have->cells) {
    if (!in_range(run)) return false;
    for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell) {
      const std::uint32_t count = source_->segment_count(cell);
      if (run.prefix != kAllSegments && run.prefix > count) return false;
      sent_[cell] = static_cast<std::uint16_t>(std::min(run.prefix, count));
    }
  }
  return true;
}

void SendPlan::set_wants(std::uint32_t epoch, std::vector<CellRun> runs) {
  epoch_ = epoch;
  runs_ = std::move(runs);
  run_ = 0;
  run_cell_ = 0;
  done_pending_ = true;
}

bool SendPlan::release(const std::vector<CellRun>& runs) {
  for (const CellRun& run : runs) {
    if (!in_range(run)) return false;
    for (std::uint32_t cell = run.first_cell; cell < run.first_cell + run.cell_count; ++cell) {
      sent_[cell] = static_cast<std::uint16_t>(std::min<std::uint32_t>(sent_[cell], run.prefix));
    }
  }
  return true;
}

SendPlan::Next SendPlan::next(std::uint64_t credit_bytes, std::size_t& entry_budget, DataFrame& frame) {
  if (!source_) return Next::idle;
  for (const bool head : {true, false}) {
    std::uint64_t& sent = head ? head_sent_ : index_sent_;
    const Bytes blob = head ? source_->head() : source_->index();
    if (sent >= blob.size()) continue;
    const std::size_t size = std::min<std::size_t>(kMaxChunkBytes, blob.size() - sent);
    if (size > credit_bytes) return Next::no_credit;
    frame = {head ? FrameType::head_data : FrameType::index_data, 0, 0, static_cast<std::uint32_t>(sent), 0,
             blob.subspan(static_cast<std::size_t>(sent), size)};
    sent += size;
    return Next::frame;
  }
  if (part_) {
    const Bytes whole = source_->segment(part_->cell, part_->segment);
    if (std::min<std::size_t>(kMaxChunkBytes, whole.size() - part_->offset_bytes) > credit_bytes)
      return Next::no_credit;
    give_segment(part_->cell, part_->segment, part_->offset_bytes, whole, frame);
    return Next::frame;
  }
  return next_wanted(credit_bytes, entry_budget, frame);
}

void SendPlan::give_segment(std::uint32_t cell, std::uint32_t segment, std::uint32_t offset_bytes, Bytes whole,
                            DataFrame& frame) {
  const bool single = whole.size() <= kMaxChunkBytes;
  const Bytes blob = whole.subspan(offset_bytes, std::min(kMaxChunkBytes, whole.size() - offset_bytes));
  frame = {single ? FrameType::segment : FrameType::segment_part,
           cell,
           segment,
           offset_bytes,
           static_cast<std::uint32_t>(whole.size()),
           blob};
  const auto end = static_cast<std::uint32_t>(offset_bytes + blob.size());
  if (end < whole.size()) {
    part_ = OpenSegment{cell, segment, end};
  } else {
    part_.reset();
  }
}

SendPlan::Next SendPlan::next_wanted(std::uint64_t credit_bytes, std::size_t& entry_budget, DataFrame& frame) {
  for (; run_ < runs_.size(); ++run_, run_cell_ = 0) {
    const CellRun run = runs_[run_];
    if (!in_range(run)) return drop_wants(), Next::out_of_range;
    for (; run_cell_ < run.cell_count; ++run_cell_) {
      if (entry_budget == 0) return Next::out_of_work;
      --entry_budget;
      const std::uint32_t cell = run.first_cell + run_cell_;
      const std::uint32_t count = std::min(source_->segment_count(cell), kMaxSegmentsPerCell);
      const std::uint32_t segment = sent_[cell];
      if (segment >= std::min(run.prefix, count)) continue;
      const Bytes whole = source_->segment(cell, segment);
      if (whole.size() > kMaxSegmentBytes) return Next::too_large;
      if (std::min(kMaxChunkBytes, whole.size()) > credit_bytes) return Next::no_credit;
      ++sent_[cell];
      give_segment(cell, segment, 0, whole, frame);
      return Next::frame;
    }
  }
  if (!done_pending_) return Next::idle;
  done_pending_ = false;
  return Next::wants_done;
}

bool SendPlan::take_back(const DataFrame& frame) {
  if (frame.type == FrameType::head_data || frame.type == FrameType::index_data) return false;
  if (frame.type == FrameType::segment_part) {
    part_ = OpenSegment{frame.cell, frame.segment, frame.offset_bytes};
    if (frame.offset_bytes == 0) part_.reset();
  }
  if (frame.offset_bytes == 0)
    sent_[frame.cell] = std::min(sent_[frame.cell], static_cast<std::uint16_t>(frame.segment));
  return true;
}

}  // namespace fanstream
