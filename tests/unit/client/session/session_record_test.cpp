#include "client/session/session_record.h"

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

namespace fanstream {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

FrameRecord frame(std::uint32_t number, std::uint64_t bytes, std::optional<double> error_px) {
  FrameRecord record;
  record.frame = number;
  record.time_s = 0.25 * number;
  record.received_bytes = bytes;
  record.segment_bytes = bytes / 2;
  record.segments = number;
  record.error_px = error_px;
  record.triangles = error_px ? 100 * number : 0;
  return record;
}

// Nothing, then ever finer, then a jump that loses 700 bytes and starts over.
std::vector<FrameRecord> session() {
  std::vector<FrameRecord> frames{frame(0, 0, {}),     frame(1, 500, 12.0), frame(2, 1000, 7.0),
                                  frame(3, 2000, 3.0), frame(4, 3000, 5.0), frame(5, 3500, 1.0),
                                  frame(6, 4000, 9.0), frame(7, 5200, 4.0), frame(8, 6000, 1.5)};
  frames[6].cut = true;
  for (std::size_t i = 6; i < frames.size(); ++i) frames[i].stale_bytes = i == 6 ? 300 : 700;
  frames[3].state = ViewState::degraded;
  frames[3].reason = "the server, \"srv\",\nstalls";
  frames[5].difference = PictureDifference{40.5, 0.25};
  frames[8].difference = PictureDifference{kInfinity, 0.0};
  frames[8].state = ViewState::complete;
  frames[2].plan_ms = 3.0;
  frames[2].splits_applied = 50;
  frames[6].splits_undone = 20;
  return frames;
}

TEST(SessionSummary, TellsWhenEachErrorWasReachedInEachShot) {
  const SessionSummary summary = summarise(session(), {});
  ASSERT_EQ(summary.shots.size(), 2U);
  const Shot& first = summary.shots[0];
  ASSERT_TRUE(first.reached[0] && first.reached[1] && first.reached[2] && first.reached[3]);
  EXPECT_EQ(first.reached[0]->time_s, 0.5);
  EXPECT_EQ(first.reached[0]->received_bytes, 1000U);
  EXPECT_EQ(first.reached[1]->received_bytes, 2000U);
  EXPECT_EQ(first.reached[2]->received_bytes, 3500U);
  EXPECT_EQ(first.reached[3]->time_s, 1.25);
  EXPECT_EQ(first.end_error_px, 1.0);
  EXPECT_EQ(first.stale_bytes, 0U);
  const Shot& second = summary.shots[1];
  EXPECT_EQ(second.first_frame, 6U);
  EXPECT_EQ(second.start_s, 1.5);
  EXPECT_EQ(second.reached[0]->time_s, 0.25);
  EXPECT_EQ(second.reached[0]->received_bytes, 1700U);  // since the frame before the cut
  EXPECT_EQ(second.reached[2]->received_bytes, 2500U);
  EXPECT_FALSE(second.reached[3]);
  EXPECT_EQ(second.stale_bytes, 700U);
}

TEST(SessionSummary, AddsUpWhatFramesDidAndTakesTheRestFromTheLast) {
  const SessionSummary summary = summarise(session(), PeerDownload{1000, 0.5, 0.25});
  EXPECT_EQ(summary.frames, 9U);
  EXPECT_EQ(summary.duration_s, 2.0);
  EXPECT_EQ(summary.first_image_s, 0.25);
  EXPECT_EQ(summary.first_image_bytes, 500U);
  EXPECT_EQ(summary.received_bytes, 6000U);
  EXPECT_EQ(summary.stale_bytes, 700U);
  EXPECT_EQ(summary.splits_applied, 50U);
  EXPECT_EQ(summary.splits_undone, 20U);
  EXPECT_NEAR(summary.plan_ms_mean, 3.0 / 9.0, 1e-12);
  EXPECT_EQ(summary.plan_ms_worst, 3.0);
  EXPECT_EQ(summary.psnr_db_least, 40.5);
  EXPECT_EQ(summary.degraded_frames, 1U);
  EXPECT_EQ(summary.end_state, ViewState::complete);
  EXPECT_EQ(summary.draco->picture_s(), 0.75);
  EXPECT_EQ(summarise(session(), {}, FirstImage{0.1, 321}).first_image_bytes, 321U);
}

TEST(SessionSummary, OfNothingIsEmpty) {
  const SessionSummary summary = summarise({}, {});
  EXPECT_EQ(summary.frames, 0U);
  EXPECT_FALSE(summary.first_image_s);
  EXPECT_TRUE(summary.shots.empty());
  EXPECT_FALSE(to_text({}, summary).empty());
  EXPECT_TRUE(nlohmann::json::accept(to_json({}, summary, {})));
}

// Splits one line, quotes respected.
std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> result(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (c == ',' && !quoted) {
      result.emplace_back();
    } else {
      result.back() += c;
    }
  }
  return result;
}

TEST(SessionCsv, HasOneLineAFrameWithAFieldForEachName) {
  std::istringstream csv(to_csv(session()));
  std::string line;
  ASSERT_TRUE(std::getline(csv, line));
  const std::vector<std::string> names = fields(line);
  EXPECT_EQ(names.front(), "frame");
  EXPECT_EQ(names.back(), "stale_bytes");
  const auto at = [&names](const std::string& name) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  std::vector<std::vector<std::string>> rows;
  while (std::getline(csv, line)) rows.push_back(fields(line));
  ASSERT_EQ(rows.size(), session().size());
  for (const auto& row : rows) ASSERT_EQ(row.size(), names.size());
  EXPECT_EQ(rows[0][at("error_px")], "");
  EXPECT_EQ(rows[1][at("time_s")], "0.25");
  EXPECT_EQ(rows[1][at("error_px")], "12");
  EXPECT_EQ(rows[1][at("psnr_db")], "");
  EXPECT_EQ(rows[5][at("psnr_db")], "40.5");
  EXPECT_EQ(rows[5][at("differing_share")], "0.25");
  EXPECT_EQ(rows[8][at("psnr_db")], "inf");
  EXPECT_EQ(rows[3][at("state")], "degraded");
  EXPECT_EQ(rows[3][at("reason")], "\"the server, \"\"srv\"\", stalls\"");
  EXPECT_EQ(rows[6][at("cut")], "1");
  EXPECT_EQ(rows[8][at("stale_bytes")], "700");
}

TEST(SessionJson, HoldsHeaderSummaryAndFrames) {
  SessionHeader header;
  header.source = "host:1/\xFFmodel";  // no UTF-8
  header.width = 640;
  header.link_mbit_s = 10.0;
  const std::vector<FrameRecord> frames = session();
  const nlohmann::json json =
      nlohmann::json::parse(to_json(header, summarise(frames, PeerDownload{1000, 0.5, 0.25}), frames));
  EXPECT_EQ(json["session"]["size_px"][0], 640);
  EXPECT_EQ(json["session"]["link_mbit_s"], 10.0);
  EXPECT_TRUE(json["session"]["round_trip_ms"].is_null());
  EXPECT_EQ(json["summary"]["shots"][1]["reached"][0]["received_bytes"], 1700);
  EXPECT_TRUE(json["summary"]["shots"][1]["reached"][3]["time_s"].is_null());
  EXPECT_EQ(json["summary"]["draco"]["picture_s"], 0.75);
  ASSERT_EQ(json["frames"].size(), frames.size());
  EXPECT_TRUE(json["frames"][0]["error_px"].is_null());
  EXPECT_EQ(json["frames"][5]["psnr_db"], 40.5);
  EXPECT_TRUE(json["frames"][8]["psnr_db"].is_null());
  EXPECT_EQ(json["frames"][8]["differing_share"], 0.0);
  EXPECT_EQ(json["frames"][3]["reason"], frames[3].reason);
  EXPECT_FALSE(nlohmann::json::parse(to_json(header, summarise(frames, {}), {})).contains("frames"));
}

TEST(SessionText, FitsEightyColumnsWhateverItHolds) {
  SessionHeader header;
  header.model = std::string(300, 'm');
  header.path = std::string(300, 'p') + "\n\x1b[2J";
  header.link_mbit_s = 123456.789;
  header.round_trip_ms = 123456.789;
  std::vector<FrameRecord> frames = session();
  frames[3].reason = std::string(500, 'r') + "\n";
  for (FrameRecord& f : frames) f.received_bytes *= 1'000'000'000'000;
  for (int i = 0; i < 3; ++i) frames.insert(frames.end(), frames.begin(), frames.begin() + 9);
  SessionSummary summary = summarise(frames, PeerDownload{123'456'789'012, 98765.4321, 9876.54321});
  EXPECT_EQ(summary.shots.size(), 5U);
  std::istringstream text(to_text(header, summary));
  std::string line;
  int lines = 0;
  while (std::getline(text, line)) {
    ++lines;
    EXPECT_LE(line.size(), 80U) << line;
    EXPECT_EQ(line.find('\x1b'), std::string::npos);
  }
  EXPECT_GT(lines, 30);
}

}  // namespace
}  // namespace fanstream
