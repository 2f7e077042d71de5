// A model of a server or of an asset file, received as far as a focus needs it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/collision/local_restoration.h"
#include "client/model/segment_stream.h"

namespace fanstream {

struct RestorationFetchOptions {
  SegmentStreamOptions stream;
  // While segments come: received bytes of all that the model has.
  std::function<void(std::uint64_t received_bytes, std::uint64_t model_bytes)> on_progress = {};
};

// Not thread safe.
class RestorationFetch {
 public:
  // Opens the source and receives FM0 and the whole index: of a large model its pages, and with each of these the
  // segments of its cell. Errors as of SegmentStream, and bad_input for what cannot be read.
  static Result<std::unique_ptr<RestorationFetch>> open(const std::string& source,
                                                        const RestorationFetchOptions& options);

  // LocalRestoration::move, and again with the segments that it lacks until it lacks none: the focus is covered then.
  // Cells tell where they lie only once they are there, so that takes a few round trips. Fails where the stream does,
  // (interrupted) by the stream's stop, (bad_input) at a damaged segment.
  Result<RestorationMove> move(const Focus& focus);

  LocalRestoration& model() { return *model_; }
  const std::string& name() const { return stream_->name(); }
  std::string model_name() const { return stream_->model(); }
  Digest digest() const { return stream_->digest(); }
  std::uint64_t received_bytes() const { return stream_->received_bytes(); }  // with all that the protocol adds
  std::uint64_t model_bytes() const { return preamble_.file_bytes(); }        // the whole asset's

 private:
  RestorationFetch(std::unique_ptr<SegmentStream> stream, RestorationFetchOptions options)
      : stream_(std::move(stream)), options_(std::move(options)) {}
  Result<void> receive_sections();
  struct ReceivedSegment {
    std::uint32_t cell = 0;
    std::uint32_t segment = 0;
    std::vector<std::byte> bytes;
  };
  Result<void> receive_pages(const AssetHead& head, AssetIndex& index, std::vector<ReceivedSegment>& early);
  Result<void> receive(const std::vector<CellTarget>& missing);
  Result<void> receive_wanted(std::uint32_t number,
                              const std::function<Result<void>(const event::SegmentArrived&)>& take);

  std::unique_ptr<SegmentStream> stream_;
  RestorationFetchOptions options_;
  AssetPreamble preamble_;
  std::unique_ptr<LocalRestoration> model_;
};

}  // namespace fanstream
