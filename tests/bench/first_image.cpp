#include "tests/bench/first_image.h"

#include <algorithm>

#include "client/session/simulated_connection.h"
#include "client/session/view_model.h"
#include "tests/bench/thread_clock.h"

namespace fanstream::bench {

namespace {

constexpr TimeUs kLongestUs = 3'600'000'000;

Result<double> decode_seconds(const OpenAsset& asset, int repetitions) {
  std::vector<double> seconds;
  for (int i = 0; i < repetitions; ++i) {
    const double start = thread_cpu_seconds();
    Result<AssetHead> head = read_head(asset.head(), "the asset");
    if (!head) return tl::unexpected(head.error());
    const ViewModel model(std::make_shared<const AssetHead>(std::move(*head)));
    const TriangleMesh mesh = model.mesh().triangle_mesh();
    seconds.push_back(thread_cpu_seconds() - start);
    if (mesh.triangles.empty()) return fail(ErrorKind::bad_input, "FM0 has no triangles");
  }
  std::nth_element(seconds.begin(), seconds.begin() + repetitions / 2, seconds.end());
  return seconds[static_cast<std::size_t>(repetitions / 2)];
}

}  // namespace

Result<FirstImage> measure_first_image(const std::shared_ptr<const OpenAsset>& asset, const DracoFile& draco,
                                       const VirtualLinkOptions& link, int repetitions) {
  FirstImage image;
  SimulatedConnectionOptions options;
  options.link = link;
  SimulatedConnection connection(asset, options);
  connection.open("model");
  TimeUs head_us = 0;
  while (head_us == 0 && connection.now_us() < kLongestUs) {
    const Result<void> ran =
        connection.run_until(connection.now_us() + 1'000'000, [&](const ClientEvent& event, TimeUs now_us) {
          if (std::holds_alternative<event::HeadComplete>(event)) head_us = now_us;
        });
    if (!ran) return tl::unexpected(ran.error());
  }
  if (head_us == 0) return fail(ErrorKind::bad_input, "the head does not come within an hour");
  const Result<double> decoding = decode_seconds(*asset, repetitions);
  if (!decoding) return tl::unexpected(decoding.error());
  image.decode_s = *decoding;
  image.request_s = 1e-6 * static_cast<double>(link.round_trip_us());  // it goes out with the greeting
  image.ours_s = 1e-6 * static_cast<double>(head_us) + image.decode_s;
  image.draco = download_of(draco, link);
  image.draco_request_s = 1e-6 * static_cast<double>(link.round_trip_us());
  return image;
}

}  // namespace fanstream::bench
