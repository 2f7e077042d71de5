// What the listener needs of a store of models: names, states and, when ready, the asset. The store implements it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/asset/segment_source.h"
#include "protocol/messages.h"

namespace fanstream {

struct ModelStatus {
  enum class State { unknown, building, ready, failed };
  State state = State::unknown;
  double fraction = 0;                          // building: 0 to 1
  std::string reason;                           // failed
  std::shared_ptr<const SegmentSource> source;  // ready, not null; kept alive by every session that sends it
};

// Thread safety: all members are called from any number of threads at once. They must return quickly (no building
// inside): open() is asked again every ServerOptions::building_poll_ms while a client waits for a model that is being
// built.
class ModelProvider {
 public:
  virtual ~ModelProvider() = default;
  // Sorted as it is to be shown. At most kMaxCatalogueEntries.
  virtual std::vector<CatalogueEntry> catalogue() = 0;
  // The state of a model. May start building it in the background.
  virtual ModelStatus open(const std::string& name) = 0;
};

}  // namespace fanstream
