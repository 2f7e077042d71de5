// Learns the statistics that are built into the coder (common/coding/default_statistics.inc) from a corpus of models.
#pragma once

#include <span>
#include <string>

#include "common/mesh/triangle_mesh.h"
#include "server/build/split_training.h"

namespace fanstream::bench {

// Gathers splits of any number of models; each model and grid counts alike, however large it is.
class StatisticsTraining {
 public:
  StatisticsTraining();
  // Builds the model on a grid of so many bits and looks at its splits. Precondition: build_asset's.
  Result<void> add(const TriangleMesh& mesh, int position_bits);
  // The built-in statistics with everything replaced that the corpus shows often enough.
  SplitStatistics learn() const;

 private:
  CountingCoder::Counts counts_;
  GeometryTraining geometry_;
};

// The statistics as C++ source, with `comment` on its first line.
std::string statistics_source(const SplitStatistics& statistics, const std::string& comment);

}  // namespace fanstream::bench
