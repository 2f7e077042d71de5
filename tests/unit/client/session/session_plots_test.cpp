#include "client/session/session_plots.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace fanstream {
namespace {

// A still view over 10 Mbit/s and a jump after 3 s, at 25 frames a second.
std::vector<FrameRecord> session() {
  std::vector<FrameRecord> frames;
  for (std::uint32_t i = 0; i <= 150; ++i) {
    FrameRecord frame;
    frame.frame = i;
    frame.time_s = i / 25.0;
    frame.cut = i == 75;
    const double since_s = frame.time_s - (i < 75 ? 0.0 : 2.7);
    frame.received_bytes =
        static_cast<std::uint64_t>(std::min(1.25e6 * std::max(0.0, frame.time_s - 0.16), 6e5 + (i < 75 ? 0 : 4e5)));
    if (frame.time_s >= 0.2) {
      frame.error_px = std::max(0.9, 60.0 * std::pow(since_s + 0.1, -1.2) / 8.0);
      frame.triangles = 1000;
    }
    frames.push_back(frame);
  }
  return frames;
}

int colored(const Image& image) {
  int count = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4)
    count += std::abs(image.rgba[i] - image.rgba[i + 2]) > 60 ? 1 : 0;
  return count;
}

TEST(SessionPlots, DrawOursAndThePeersCurve) {
  const PeerDownload draco{900'000, 0.82, 0.17};
  for (const auto& [name, plot] :
       {std::pair{"error_by_bytes.png", &plot_error_by_bytes}, {"error_by_time.png", &plot_error_by_time}}) {
    const Result<Image> both = plot("bunny, jump, 10 Mbit/s, 50 ms", session(), draco);
    ASSERT_TRUE(both) << both.error().message;
    const Result<Image> alone = plot("bunny, jump, 10 Mbit/s, 50 ms", session(), {});
    ASSERT_TRUE(alone);
    EXPECT_GT(colored(*alone), 500);
    EXPECT_GT(colored(*both), colored(*alone) + 500);
    // To be looked at.
    if (const char* folder = std::getenv("FANSTREAM_PICTURES")) {
      EXPECT_TRUE(write_png(*both, std::filesystem::path(folder) / name));
    }
    EXPECT_EQ(plot("", {}, draco).error().kind, ErrorKind::usage);
    // Nothing but waiting.
    EXPECT_TRUE(plot("", std::vector<FrameRecord>(3), draco));
  }
}

}  // namespace
}  // namespace fanstream
