// Learns the statistics that are built into the coder (common/coding/default_statistics.inc) from a corpus of models.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "server/build/split_training.h"
#include "tests/bench/context_clusters.h"

namespace fanstream::bench {

// What is built in: which table each context has, by phase, and the numbers.
struct TrainedStatistics {
  std::array<std::array<std::uint8_t, SymbolContexts::kContexts>, CodingPhase::kPhases> tables{};
  SplitStatistics statistics;
  static TrainedStatistics built_in();
};

// Gathers splits of any number of models; each model and grid counts alike, however large it is.
class StatisticsTraining {
 public:
  StatisticsTraining();
  // Builds the model on a grid of so many bits and looks at its splits. Precondition: build_asset's.
  Result<void> add(const TriangleMesh& mesh, int position_bits);
  // Contexts put together and their tables learnt anew; of the built-in rest everything replaced that the corpus shows
  // often enough.
  TrainedStatistics learn() const;

 private:
  std::vector<SymbolCounts> counts_;  // by phase and context
  GeometryTraining geometry_;
};

// The statistics as C++ source, with `comment` on its first line.
std::string statistics_source(const TrainedStatistics& trained, const std::string& comment);

}  // namespace fanstream::bench
