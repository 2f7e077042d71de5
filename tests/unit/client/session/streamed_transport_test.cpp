// What a stream by the clock tells of a server's notices.
#include <gtest/gtest.h>

#include <thread>

#include "client/session/session_transport.h"
#include "common/asset/asset_file.h"
#include "protocol/frame.h"
#include "tests/support/raw_socket.h"
#include "tests/support/small_assets.h"

namespace fanstream {
namespace {

// Says this to the first who connects, and waits until he has gone.
class Speaker {
 public:
  explicit Speaker(std::vector<std::byte> script)
      : thread_([this, script = std::move(script)] {
          RawSocket socket = listener_.accept();
          socket.send(script);
          socket.receive_all();
        }) {}
  ~Speaker() { thread_.join(); }
  std::string source() const { return "127.0.0.1:" + std::to_string(listener_.port()) + "/model"; }

 private:
  RawListener listener_;
  std::thread thread_;
};

void add_blob(FrameType type, std::span<const std::byte> blob, std::vector<std::byte>& script) {
  ASSERT_LE(blob.size(), kMaxChunkBytes);
  const DataFrameHeader header(type, std::array<std::uint32_t, 1>{0}, blob);
  script.insert(script.end(), header.bytes().begin(), header.bytes().end());
  script.insert(script.end(), blob.begin(), blob.end());
}

TEST(StreamedTransport, ANoticeThatAllIsWellAgainIsNoHindrance) {
  const auto asset = AssetFile::from_memory(testing::small_asset(), "torus").value();
  std::vector<std::byte> script;
  encode(Welcome{}, script);
  Opened opened;
  opened.digest = asset->digest();
  opened.cell_count = asset->cell_count();
  for (std::uint32_t cell = 0; cell < asset->cell_count(); ++cell) opened.segment_total += asset->segment_count(cell);
  opened.head_size_bytes = asset->head().size();
  opened.index_size_bytes = asset->index().size();
  encode(opened, script);
  add_blob(FrameType::head_data, asset->head(), script);
  add_blob(FrameType::index_data, asset->index(), script);
  encode(Degraded{DegradedReason::no_credit, "wanted data waits"}, script);
  encode(Degraded{DegradedReason::none, "sending again"}, script);
  const Speaker server(script);

  SessionSettings settings;
  settings.source = server.source();
  settings.real_time = true;
  auto transport = streamed_transport(settings);
  ASSERT_TRUE(transport) << transport.error().message;
  std::vector<std::string> reasons;
  while (reasons.size() < 2 && (*transport)->now_s() < 60.0) {
    const auto ran = (*transport)->run_until((*transport)->now_s() + 0.02, [&](const TransportEvent& event, double) {
      if (const auto* hindered = std::get_if<event::Hindered>(&event)) reasons.push_back(hindered->reason);
      return Result<void>();
    });
    ASSERT_TRUE(ran) << ran.error().message;
  }
  EXPECT_EQ(reasons, (std::vector<std::string>{"wanted data waits", ""}));
}

TEST(SessionTransport, OnlyAReasonHinders) {
  EXPECT_EQ(hindrance_of({DegradedReason::none, "sending again"}).reason, "");
  EXPECT_EQ(hindrance_of({DegradedReason::no_credit, "waits"}).reason, "waits");
  EXPECT_EQ(hindrance_of({static_cast<DegradedReason>(77), "of a later version"}).reason, "of a later version");
}

}  // namespace
}  // namespace fanstream
