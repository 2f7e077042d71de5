#include "tests/bench/model_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace fanstream::bench {

namespace {

template <class Value>
std::vector<double> each(const std::vector<ModelFigures>& models, Value value) {
  std::vector<double> values;
  for (const ModelFigures& m : models) values.push_back(value(m));
  return values;
}

Section sizes(const std::vector<ModelFigures>& models) {
  Table table({{"model", "", 0},
               {"vertices", "", 0},
               {"triangles", "", 0},
               {"components", "comp.", 0},
               {"total_bytes", "bytes", 0},
               {"base_bytes", "base", 0},
               {"split_bytes", "splits", 0},
               {"table_bytes", "tables", 0},
               {"bits_per_vertex", "bits/v", 2},
               {"draco7_bits_per_vertex", "Draco 7", 2},
               {"draco10_bits_per_vertex", "Draco 10", 2},
               {"size_ratio", "/ Draco 10", 3},
               {"base_vertices", "base v", 0},
               {"generations", "gen.", 0},
               {"cells", "", 0},
               {"segments", "", 0},
               {"quantised_otherwise", "ties", 0}});
  for (const ModelFigures& m : models) {
    const BuildReport& b = m.build;
    table.add_row({m.model, whole(b.vertices), whole(b.triangles), whole(b.components), whole(b.total_bytes),
                   whole(b.base_bytes), whole(b.split_bytes), whole(b.table_bytes), b.bits_per_vertex(),
                   m.draco7.bits_per_vertex, m.draco10.bits_per_vertex, m.size_ratio(), whole(b.base_vertices),
                   whole(b.generations), whole(b.cells), whole(b.segments), whole(m.quantised_otherwise)});
  }
  return {"sizes",
          fmt::format("Sizes, positions only, on a grid of {} bits, the same for Draco 1.5.5; everything included "
                      "(ties: vertices halfway between two grid points that Draco's own quantiser rounds otherwise)",
                      models.empty() ? 0 : models.front().build.position_bits),
          std::move(table)};
}

Section forced(const std::vector<ModelFigures>& models) {
  Table table({{"model", "", 0},
               {"disc1_splits_percent", "1 %: splits %", 2},
               {"disc1_bytes_percent", "bytes %", 2},
               {"disc10_splits_percent", "10 %: splits %", 2},
               {"disc10_bytes_percent", "bytes % ", 2}});
  for (const ModelFigures& m : models) {
    table.add_row(
        {m.model, percent(m.disc1.splits), percent(m.disc1.bytes), percent(m.disc10.splits), percent(m.disc10.bytes)});
  }
  return {"forced_share",
          "Forced share: splits, and bytes of whole segments, that a disc of 1 % and of 10 % of the vertices needs in "
          "full (mean of random discs)",
          std::move(table)};
}

Cell on_one_core(const ModelFigures& m) {
  if (m.one_processor_seconds == 0.0) return std::monostate{};
  return m.build_mtriangles_one_s();
}

Section speed(const std::vector<ModelFigures>& models) {
  Table table({{"model", "", 0},
               {"decode_mtriangles_s", "decode Mtri/s", 2},
               {"draco7_decode_mtriangles_s", "Draco 7", 2},
               {"draco10_decode_mtriangles_s", "Draco 10", 2},
               {"decode_ratio", "/ Draco 10", 2},
               {"import_seconds", "import s", 3},
               {"build_seconds", "build s", 3},
               {"build_mtriangles_s", "build Mtri/s", 3},
               {"build_mtriangles_one_processor_s", "on one core", 3},
               {"peak_memory_mb", "peak MB", 0},
               {"issued_per_vertex_full", "issued/n, full", 3},
               {"issued_per_vertex", "worst level", 3},
               {"issued_worst_vertices", "at vertices", 0},
               {"issued_worst_triangles", "at triangles", 0}});
  for (const ModelFigures& m : models) {
    table.add_row({m.model, m.decode_mtriangles_s(), m.draco7.decode_mtriangles_s, m.draco10.decode_mtriangles_s,
                   m.decode_ratio(), m.import_seconds, m.build_seconds, m.build_mtriangles_s(), on_one_core(m),
                   static_cast<double>(m.peak_memory_bytes) * 1e-6, m.issued_per_vertex_full, m.issued_per_vertex,
                   whole(m.issued_worst_vertices), whole(m.issued_worst_triangles)});
  }
  return {
      "speed",
      "Speed: decode is from the asset's bytes to the full model's index buffer (median, one thread), build is import, "
      "cleaning, building and serialising (once, on all cores, and once on one), peak is the whole process's; and "
      "issued vertices when drawn as fans",
      std::move(table)};
}

// Nothing where the two cannot be compared.
Cell ratio(double LevelShape::*figure, const LevelShape& ours, const LevelShape& peer) {
  if (!LevelQuality::comparable(ours, peer)) return std::monostate{};
  return ours.*figure / peer.*figure;
}

Section shape(const std::vector<ModelFigures>& models) {
  Table table({{"model", "", 0},
               {"level_percent", "level %", 0},
               {"vertices", "", 0},
               {"triangles", "", 0},
               {"rms", "RMS", -3},
               {"max", "max", -3},
               {"peer_triangles", "Q: tri.", 0},
               {"peer_rms", "RMS", -3},
               {"rms_ratio", "ours / Q", 3},
               {"peer_max", "max", -3},
               {"max_ratio", "ours / Q", 3},
               {"original_triangles", "O: tri.", 0},
               {"original_rms", "RMS", -3},
               {"original_rms_ratio", "ours / O", 3},
               {"original_max", "max", -3},
               {"original_max_ratio", "ours / O", 3}});
  for (const ModelFigures& m : models) {
    for (const LevelQuality& l : m.levels) {
      const auto of = [&](const LevelShape& peer) {
        return std::array<Cell, 5>{whole(peer.triangles), peer.rms, ratio(&LevelShape::rms, l.ours, peer), peer.max,
                                   ratio(&LevelShape::max, l.ours, peer)};
      };
      std::vector<Cell> row{m.model,    percent(l.share), whole(l.vertices), whole(l.ours.triangles),
                            l.ours.rms, l.ours.max};
      for (const LevelShape* peer : {&l.peer, &l.peer_original}) {
        for (Cell& cell : of(*peer)) row.push_back(std::move(cell));
      }
      table.add_row(std::move(row));
    }
  }
  return {
      "shape",
      "Distance to the quantised full model, relative to its diagonal, both directions: ours beside meshoptimizer's "
      "simplifier at the same number of triangles, started from that same quantised model (Q), and from the model "
      "before it was quantised, as ours is, with the result put on the grid (O). No ratio where meshoptimizer stopped "
      "more than 2 % above that number",
      std::move(table)};
}

// Of the levels of at least `least_share` that can be compared.
double mean_ratio(const std::vector<ModelFigures>& models, double least_share, double LevelShape::*figure,
                  LevelShape LevelQuality::*peer) {
  std::vector<double> ratios;
  for (const ModelFigures& m : models) {
    for (const LevelQuality& l : m.levels) {
      if (l.share < least_share - 1e-9 || !LevelQuality::comparable(l.ours, l.*peer)) continue;
      ratios.push_back(l.ours.*figure / (l.*peer).*figure);
    }
  }
  return geometric_mean(ratios);
}

template <class Value>
const ModelFigures& greatest(const std::vector<ModelFigures>& models, Value value) {
  return *std::max_element(models.begin(), models.end(),
                           [&](const ModelFigures& a, const ModelFigures& b) { return value(a) < value(b); });
}

void size_limits(const std::vector<ModelFigures>& models, Limits& limits) {
  limits.at_most("2 bytes / Draco 10", "geometric mean",
                 geometric_mean(each(models, [](const auto& m) { return m.size_ratio(); })), 1.40);
  for (const bool regular : {false, true}) {
    std::vector<ModelFigures> some;
    for (const ModelFigures& m : models) {
      if (m.regular_height_field == regular) some.push_back(m);
    }
    if (some.empty()) continue;
    const ModelFigures& worst = greatest(some, [](const auto& m) { return m.size_ratio(); });
    limits.at_most("2 bytes / Draco 10", worst.model + (regular ? " (regular height field)" : " (worst)"),
                   worst.size_ratio(), regular ? 2.5 : 1.75);
  }
}

Section limits_of(const std::vector<ModelFigures>& models) {
  Limits limits;
  const ModelFigures& base = greatest(models, [](const auto& m) { return m.build.base_vertices / m.base_limit(); });
  limits.at_most("1 base vertices", base.model + " (worst)", base.build.base_vertices, base.base_limit());
  size_limits(models, limits);
  for (const auto& [peer, name] : {std::pair{&LevelQuality::peer, "Q"}, {&LevelQuality::peer_original, "O"}}) {
    const auto mean = [&, p = peer](double least, double LevelShape::*figure) {
      return mean_ratio(models, least, figure, p);
    };
    const std::string fine = fmt::format("geometric mean, 50 to 5 %, {}", name);
    limits.at_most("3 RMS / meshoptimizer", fine, mean(0.05, &LevelShape::rms), 1.05);
    limits.measured("  max / meshoptimizer", fine, mean(0.05, &LevelShape::max));
    const std::string all = fmt::format("geometric mean, all levels, {}", name);
    limits.measured("  RMS / meshoptimizer", all, mean(0.0, &LevelShape::rms));
    limits.measured("  max / meshoptimizer", all, mean(0.0, &LevelShape::max));
  }
  const ModelFigures& slowest = greatest(models, [](const auto& m) { return -m.decode_ratio(); });
  limits.at_least("4 decode / Draco 10", slowest.model + " (worst)", slowest.decode_ratio(), 1.0);
  limits.measured("  decode / Draco 10", "geometric mean",
                  geometric_mean(each(models, [](const auto& m) { return m.decode_ratio(); })));
  const ModelFigures& largest = greatest(models, [](const auto& m) { return m.build.triangles; });
  const double one_core =
      largest.one_processor_seconds > 0.0 ? largest.build_mtriangles_one_s() : largest.build_mtriangles_s();
  limits.at_least("5 build Mtri/s, one core", largest.model + " (largest)", one_core, 0.15);
  limits.measured("  build Mtri/s, all cores", largest.model + " (largest)", largest.build_mtriangles_s());
  limits.at_most("5 peak memory MB", largest.model + " (largest)",
                 static_cast<double>(largest.peak_memory_bytes) * 1e-6, 1000.0);
  const ModelFigures& issued = greatest(models, [](const auto& m) { return m.issued_per_vertex; });
  limits.at_most("6 issued / n", issued.model + " (worst)", issued.issued_per_vertex, 2.9);
  return {"limits", "Against the limits", limits.take()};
}

}  // namespace

double geometric_mean(const std::vector<double>& values) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const double v : values) {
    if (!(v > 0.0) || !std::isfinite(v)) continue;
    sum += std::log(v);
    ++count;
  }
  return count == 0 ? 0.0 : std::exp(sum / static_cast<double>(count));
}

std::vector<Section> report_sections(const std::vector<ModelFigures>& models) {
  if (models.empty()) return {};
  return {sizes(models), forced(models), speed(models), shape(models), limits_of(models)};
}

std::string print_report(const std::vector<ModelFigures>& models, const std::vector<std::string>& context,
                         ReportFormat format) {
  return print_sections(report_sections(models), context, format);
}

}  // namespace fanstream::bench
