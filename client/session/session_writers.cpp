// The writers of session_record.h.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "client/session/session_record.h"

namespace fanstream {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kCsvNames =
    "frame,time_s,cut,received_bytes,segment_bytes,segments,splits_applied,splits_undone,triangles,issued_vertices,"
    "error_px,wanted_tolerance_px,tolerance_px,psnr_db,differing_share,plan_ms,apply_ms,draw_ms,state,reason,stale_"
    "bytes";
constexpr std::string_view kSmoothCsvNames =
    ",smooth_faces_before,smooth_eligible_faces,smooth_faces_after,smooth_depth,smooth_ms";

// Text in quotes, on one line, and no formula for a spreadsheet.
std::string csv_text(std::string_view text) {
  if (text.empty()) return {};
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return quoted + '"';
}

bool smooths(const FrameRecord& frame) { return frame.smoothing.has_value(); }

std::string smooth_csv(const std::optional<FrameSmoothing>& smoothing) {
  if (!smoothing) return ",,,,,";
  return fmt::format(",{},{},{},{},{:.4f}", smoothing->faces_before, smoothing->eligible_faces, smoothing->faces_after,
                     smoothing->depth, smoothing->smooth_ms);
}

// The shortest text that gives back the number.
std::string csv_number(const std::optional<double>& number) {
  return number ? fmt::format("{}", *number) : std::string();
}

Json json_number(double number) { return std::isfinite(number) ? Json(number) : Json(nullptr); }
template <class Number>
Json json_number(const std::optional<Number>& number) {
  return number ? json_number(static_cast<double>(*number)) : Json(nullptr);
}

Json json_of(const FrameRecord& f) {
  Json json{{"frame", f.frame},
            {"time_s", f.time_s},
            {"cut", f.cut},
            {"received_bytes", f.received_bytes},
            {"segment_bytes", f.segment_bytes},
            {"segments", f.segments},
            {"splits_applied", f.splits_applied},
            {"splits_undone", f.splits_undone},
            {"triangles", f.triangles},
            {"issued_vertices", f.issued_vertices},
            {"error_px", json_number(f.error_px)},
            {"wanted_tolerance_px", f.wanted_tolerance_px},
            {"tolerance_px", f.tolerance_px}};
  json["psnr_db"] = f.difference ? json_number(f.difference->psnr_db) : Json(nullptr);
  json["differing_share"] = f.difference ? json_number(f.difference->differing_share) : Json(nullptr);
  json["plan_ms"] = f.plan_ms;
  json["apply_ms"] = f.apply_ms;
  json["draw_ms"] = f.draw_ms;
  json["state"] = name(f.state);
  json["reason"] = f.reason.empty() ? Json(nullptr) : Json(f.reason);
  json["stale_bytes"] = f.stale_bytes;
  if (f.smoothing) {
    json["smooth_silhouette"] = {{"faces_before", f.smoothing->faces_before},
                                 {"eligible_faces", f.smoothing->eligible_faces},
                                 {"faces_after", f.smoothing->faces_after},
                                 {"depth", f.smoothing->depth},
                                 {"smooth_ms", f.smoothing->smooth_ms}};
    if (!f.smoothing->limitation.empty()) json["smooth_silhouette"]["limitation"] = f.smoothing->limitation;
  }
  return json;
}

Json json_of(const Shot& shot) {
  Json reached = Json::array();
  for (std::size_t i = 0; i < kErrorSteps.size(); ++i) {
    const std::optional<Reached>& r = shot.reached[i];
    reached.push_back({{"error_px", kErrorSteps[i]},
                       {"time_s", r ? Json(r->time_s) : Json(nullptr)},
                       {"received_bytes", r ? Json(r->received_bytes) : Json(nullptr)}});
  }
  return {{"first_frame", shot.first_frame},
          {"start_s", shot.start_s},
          {"reached", reached},
          {"end_error_px", json_number(shot.end_error_px)},
          {"stale_bytes", shot.stale_bytes}};
}

Json json_of(const SessionSummary& s) {
  Json shots = Json::array();
  for (const Shot& shot : s.shots) shots.push_back(json_of(shot));
  Json draco;  // null
  if (s.draco) {
    draco = {{"size_bytes", s.draco->size_bytes},
             {"download_s", s.draco->download_s},
             {"decode_s", s.draco->decode_s},
             {"picture_s", s.draco->picture_s()}};
  }
  Json smoothing;  // null
  if (s.smooth_ms_worst) {
    smoothing = {{"faces_after_most", s.smooth_faces_most},
                 {"smooth_ms", {{"mean", s.smooth_ms_mean}, {"worst", *s.smooth_ms_worst}}}};
  }
  return {{"frames", s.frames},
          {"duration_s", s.duration_s},
          {"first_image_s", json_number(s.first_image_s)},
          {"first_image_bytes", s.first_image_s ? Json(s.first_image_bytes) : Json(nullptr)},
          {"received_bytes", s.received_bytes},
          {"segment_bytes", s.segment_bytes},
          {"segments", s.segments},
          {"stale_bytes", s.stale_bytes},
          {"splits_applied", s.splits_applied},
          {"splits_undone", s.splits_undone},
          {"plan_ms", {{"mean", s.plan_ms_mean}, {"worst", s.plan_ms_worst}}},
          {"apply_ms", {{"mean", s.apply_ms_mean}, {"worst", s.apply_ms_worst}}},
          {"draw_ms", {{"mean", s.draw_ms_mean}, {"worst", s.draw_ms_worst}}},
          {"psnr_db_least", json_number(s.psnr_db_least)},
          {"end_state", name(s.end_state)},
          {"degraded_frames", s.degraded_frames},
          {"degraded_reason", s.degraded_reason.empty() ? Json(nullptr) : Json(s.degraded_reason)},
          {"smooth_silhouette", smoothing},
          {"shots", shots},
          {"draco", draco}};
}

Json json_of(const SessionHeader& h) {
  return {{"source", h.source},
          {"model", h.model},
          {"digest", h.digest},
          {"path", h.path},
          {"size_px", {h.width, h.height}},
          {"fps", h.fps},
          {"virtual_time", h.virtual_time},
          {"link_mbit_s", json_number(h.link_mbit_s)},
          {"round_trip_ms", json_number(h.round_trip_ms)}};
}

std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t end = text.size(); end > 3; end -= 3) text.insert(end - 3, 1, ',');
  return text;
}

// At most `width` bytes of printable text.
std::string cut_text(const std::string& text, std::size_t width) {
  std::string shown = text.size() > width ? "..." + text.substr(text.size() - width + 3) : text;
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < ' ' || c == 0x7F) c = '?';
  }
  return shown;
}

// Lines of at most `width` bytes of printable text, broken at spaces where there are any.
std::string wrap_text(const std::string& text, std::size_t width, const std::string& indent) {
  std::string lines;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = std::min(text.size(), at + width);
    const std::size_t space = end < text.size() ? text.rfind(' ', end) : std::string::npos;
    if (space != std::string::npos && space > at) end = space;
    lines += (lines.empty() ? "" : "\n" + indent) + cut_text(text.substr(at, end - at), width);
    at = end + (end < text.size() && text[end] == ' ' ? 1 : 0);
  }
  return lines;
}

std::string error_text(double error_px) {
  return std::isfinite(error_px) ? fmt::format("{:.3g} px", error_px) : std::string("nothing shown");
}

std::string shot_lines(const Shot& shot, bool only_one) {
  std::string text = only_one ? std::string("stated error") : fmt::format("from {:.2f} s", shot.start_s);
  text = fmt::format("{:<16} {:>10} {:>14}\n", text, "seconds", "bytes");
  for (std::size_t i = 0; i < kErrorSteps.size(); ++i) {
    const std::string step = fmt::format("at most {} px", kErrorSteps[i]);
    if (const std::optional<Reached>& r = shot.reached[i]) {
      text += fmt::format("  {:<14} {:>10.3f} {:>14}\n", step, r->time_s, grouped(r->received_bytes));
    } else {
      text += fmt::format("  {:<14} {:>10}\n", step, "never");
    }
  }
  return text + fmt::format("  at its end     {}, {} bytes came too late\n", error_text(shot.end_error_px),
                            grouped(shot.stale_bytes));
}

std::string time_line(const char* what, double mean, double worst) {
  return fmt::format("{:<11} {:.2f} ms a frame, {:.2f} ms the longest\n", what, mean, worst);
}

}  // namespace

std::string to_csv(std::span<const FrameRecord> frames) {
  const bool smoothed = std::any_of(frames.begin(), frames.end(), smooths);
  std::string text = std::string(kCsvNames);
  if (smoothed) text += kSmoothCsvNames;
  text += '\n';
  for (const FrameRecord& f : frames) {
    const auto of_difference = [&f](double PictureDifference::*member) {
      return f.difference ? csv_number((*f.difference).*member) : std::string();
    };
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{:.4f},{:.4f},{:.4f},{},{},{}", f.frame, f.time_s,
                        f.cut ? 1 : 0, f.received_bytes, f.segment_bytes, f.segments, f.splits_applied, f.splits_undone,
                        f.triangles, f.issued_vertices, csv_number(f.error_px), f.wanted_tolerance_px, f.tolerance_px,
                        of_difference(&PictureDifference::psnr_db), of_difference(&PictureDifference::differing_share),
                        f.plan_ms, f.apply_ms, f.draw_ms, name(f.state), csv_text(f.reason), f.stale_bytes);
    if (smoothed) text += smooth_csv(f.smoothing);
    text += '\n';
  }
  return text;
}

std::string to_json(const SessionHeader& header, const SessionSummary& summary, std::span<const FrameRecord> frames) {
  Json json{{"session", json_of(header)}, {"summary", json_of(summary)}};
  if (!frames.empty()) {
    Json list = Json::array();
    for (const FrameRecord& frame : frames) list.push_back(json_of(frame));
    json["frames"] = std::move(list);
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';  // names of files need not be UTF-8
}

std::string to_text(const SessionHeader& header, const SessionSummary& s) {
  std::string text = fmt::format("model       {}\n", cut_text(header.model, 66));
  text += fmt::format("path        {}, {} frames in {:.2f} s\n", cut_text(header.path, 36), grouped(s.frames),
                      s.duration_s);
  if (header.link_mbit_s) {
    text += fmt::format("link        {:.6g} Mbit/s, {:.6g} ms round trip, simulated\n", *header.link_mbit_s,
                        header.round_trip_ms.value_or(0.0));
  }
  text += s.first_image_s
              ? fmt::format("first image {:.3f} s, {} bytes\n", *s.first_image_s, grouped(s.first_image_bytes))
              : std::string("first image never\n");
  // A path of many cuts has its rest in the JSON file.
  constexpr std::size_t kMostShots = 4;
  for (std::size_t i = 0; i < std::min(s.shots.size(), kMostShots); ++i)
    text += shot_lines(s.shots[i], s.shots.size() == 1);
  if (s.shots.size() > kMostShots) text += fmt::format("... and {} shots more\n", s.shots.size() - kMostShots);
  text += fmt::format("received    {} bytes in {} segments, {} of them stale\n", grouped(s.received_bytes),
                      grouped(s.segments), grouped(s.stale_bytes));
  text += fmt::format("splits      {} applied, {} undone\n", grouped(s.splits_applied), grouped(s.splits_undone));
  text += time_line("plan", s.plan_ms_mean, s.plan_ms_worst);
  text += time_line("apply", s.apply_ms_mean, s.apply_ms_worst);
  if (s.draw_ms_worst > 0.0) text += time_line("draw", s.draw_ms_mean, s.draw_ms_worst);
  if (s.smooth_ms_worst) {
    text += time_line("smooth", s.smooth_ms_mean, *s.smooth_ms_worst);
    text += fmt::format("            {} faces at most\n", grouped(s.smooth_faces_most));
  }
  if (s.psnr_db_least > 0.0) {
    text += std::isfinite(s.psnr_db_least) ? fmt::format("pictures    {:.1f} dB PSNR at least\n", s.psnr_db_least)
                                           : std::string("pictures    equal to the full model's\n");
  }
  if (s.draco) {
    text += fmt::format("Draco       {} bytes, first image {:.3f} s:\n            download {:.3f} s, decode {:.3f} s\n",
                        grouped(s.draco->size_bytes), s.draco->picture_s(), s.draco->download_s, s.draco->decode_s);
  }
  text += fmt::format("at the end  {}", name(s.end_state));
  if (s.degraded_frames > 0) {
    text += fmt::format("; degraded in {} frames:\n            {}", grouped(s.degraded_frames),
                        wrap_text(s.degraded_reason, 66, std::string(12, ' ')));
  }
  return text + '\n';
}

}  // namespace fanstream
