// Where a model comes from: a server or an asset file. Either gives head, index and segments, coarse to fine.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/model/segment_order.h"
#include "client/net/stream_client.h"
#include "common/support/result.h"

namespace fanstream {

struct SourceOptions {
  StreamClientOptions client;                    // its `stop` also ends the reading of files
  std::function<void(double)> on_building = {};  // while the server builds the model: the share done, 0 to 1
};

// Errors begin with name(). Not thread safe.
class ModelSource {
 public:
  // The path of an existing file, or HOST:PORT/MODEL. Opens it and, if a server is still building the model, waits.
  static Result<std::unique_ptr<ModelSource>> open(const std::string& text, const SourceOptions& options);
  virtual ~ModelSource() = default;

  virtual const std::string& name() const = 0;  // "localhost:7370/bunny" or the file's path
  virtual std::string model() const = 0;        // "bunny": on the server, or the file's name without extension
  virtual std::uint64_t head_size_bytes() const = 0;
  virtual std::uint64_t index_size_bytes() const = 0;
  virtual Digest digest() const = 0;  // as announced

  // Wait for the section; valid as long as the source. The index comes after the head, the segments after the index.
  virtual Result<std::span<const std::byte>> head() = 0;
  virtual Result<std::span<const std::byte>> index() = 0;

  // What was read of index(): to be told before any segment is wanted.
  virtual Result<void> use_index(const AssetIndex& index) = 0;
  // The index has come to know the children of this cell, by the page that was given out last.
  virtual void learn_children(const AssetIndex& index, std::uint32_t parent) = 0;
  // From now on segments [0, end) of the order come, those given before left out. `end` never becomes less, and the
  // order stays the same one, though it may grow.
  virtual Result<void> want(const std::vector<OrderedSegment>& order, std::size_t end) = 0;
  // The bytes of the next one in the order, valid until the next call; nothing if all that are wanted have been given.
  virtual Result<std::optional<std::span<const std::byte>>> next_segment() = 0;

  // Everything that came over the network, or what was read of the file.
  virtual std::uint64_t received_bytes() const = 0;
  // By how much so many segments in order, which hold so many bytes, raise received_bytes() at most.
  virtual std::uint64_t cost_bytes(std::uint64_t segments, std::uint64_t bytes) const = 0;
  // What may come besides what was asked for: answers, signs of life.
  virtual std::uint64_t slack_bytes() const = 0;
};

}  // namespace fanstream
