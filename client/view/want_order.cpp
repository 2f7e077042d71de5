#include "client/view/want_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

namespace fanstream {
namespace {

constexpr std::uint32_t kDigitBits = 12;
constexpr std::uint32_t kDigits = 1U << kDigitBits;

// Ascending keys are falling bands, then falling utilities, as exact as 8 bits of mantissa.
std::uint32_t key_of(float threshold, float utility, float log2_anchor, float bands_per_octave) {
  const float octaves = std::log2(std::max(threshold, 1e-37F)) - log2_anchor;
  const float band = std::clamp(std::floor(octaves * bands_per_octave), -128.0F, 127.0F);
  const auto high = static_cast<std::uint32_t>(127 - static_cast<int>(band));
  return high << 16U | (0xFFFFU - (std::bit_cast<std::uint32_t>(utility) >> 15U));
}

}  // namespace

void WantOrder::collect(const WantInput& input, const PlanOptions& options) {
  const CellTable& table = input.table;
  // Layers of the asset, counted first: a counting sort.
  layer_begins_.assign(1, 0);
  std::vector<std::uint32_t> first_layers;
  for (std::uint32_t slab = 0; slab < table.slab_count(); ++slab) {
    first_layers.push_back(static_cast<std::uint32_t>(layer_begins_.size()) - 1);
    layer_begins_.resize(layer_begins_.size() + table.layers_of(slab), 0);
  }
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    const std::uint32_t layer = first_layers[table.slab_of(c)];
    for (std::uint32_t p = input.held[c]; p < input.targets[c]; ++p) ++layer_begins_[layer + p + 1];
  }
  for (std::size_t i = 1; i < layer_begins_.size(); ++i) layer_begins_[i] += layer_begins_[i - 1];
  steps_.resize(layer_begins_.back());
  slots_.resize(steps_.size());
  first_slots_.resize(table.cell_count());
  std::uint32_t slots = 0;
  JudgementWalk judgement_of(input.judgements);
  const double speculation = options.speculation_weight;
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    if (input.held[c] >= input.targets[c]) continue;
    const std::uint32_t layer = first_layers[table.slab_of(c)];
    const CellJudgement& judgement = judgement_of(c);
    first_slots_[c] = slots;
    const double weight = judgement.weight * (input.live[c] != 0 ? 1.0 : speculation);
    double px_before = judgement.error.px(table.error_at(c, input.held[c]));
    for (std::uint32_t p = input.held[c] + 1; p <= input.targets[c]; ++p) {
      const std::uint32_t index = table.step_index(c, p);
      const std::uint32_t slot = layer_begins_[layer + p - 1]++;
      const double px = judgement.error.px(table.error_at(c, p));
      const double gain_px = std::exchange(px_before, px) - px;
      Step& step = steps_[slot];
      slots_[slots++] = slot;
      const std::uint32_t bytes = table.sizes_bytes()[index];
      step = {c, static_cast<std::uint8_t>(p), bytes == 0, input.thresholds.begun(table, c, p), 0.0F, 0.0, 0.0, 0, 0,
              0};
      if (input.live[c] == 0) step.threshold *= static_cast<float>(speculation);
      step.cost = bytes;
      step.worth = std::max(0.0, weight * gain_px * judgement.area_px);
    }
  }
}

// Cell by cell, from the coarsest of its steps and needs.
void WantOrder::find_needs(const WantInput& input) {
  const CellTable& table = input.table;
  needs_.clear();
  for (std::uint32_t c = 0; c < table.cell_count(); ++c) {
    if (input.held[c] >= input.targets[c]) continue;
    const std::span<const Dependency> needs = table.needs(c);
    std::size_t begin = needs.size();
    for (std::uint32_t p = input.held[c] + 1; p <= input.targets[c]; ++p) {
      for (const std::uint32_t last = table.last_generation(c, p); begin > 0 && needs[begin - 1].generation <= last;)
        --begin;
      Step& step = steps_[slot_of(input, c, p)];
      step.needs_begin = static_cast<std::uint32_t>(needs_.size());
      table.for_each_dependency(c, p, needs.subspan(begin), [&](std::uint32_t cell, std::uint32_t q) {
        if (q <= input.held[cell] || q > input.targets[cell]) return;
        const std::uint32_t slot = slot_of(input, cell, q);
        needs_.push_back(slot);
        ++steps_[slot].dependents;
      });
      step.needs_end = static_cast<std::uint32_t>(needs_.size());
    }
  }
}

void WantOrder::share_costs() {
  for (Step& step : steps_) {
    for (std::uint32_t i = step.needs_begin; i < step.needs_end; ++i) {
      const Step& need = steps_[needs_[i]];
      step.cost += need.cost;
      step.worth += need.worth;
    }
    step.utility = static_cast<float>(std::min(1e30, step.worth / std::max(1.0, step.cost)));
    const double share = 1.0 / std::max(1U, step.dependents);
    step.cost *= share;
    step.worth *= share;
  }
}

void WantOrder::raise_needs() {
  for (std::size_t s = steps_.size(); s-- > 0;) {
    const Step& step = steps_[s];
    for (std::uint32_t i = step.needs_begin; i < step.needs_end; ++i) {
      Step& need = steps_[needs_[i]];
      need.utility = std::max(need.utility, step.utility);
      need.threshold = std::max(need.threshold, step.threshold);
    }
  }
}

void WantOrder::sort(const PlanOptions& options) {
  const float anchor =
      options.tolerance_px > 0.0 ? static_cast<float>(std::log2(std::clamp(options.tolerance_px, 1e-30, 1e30))) : 0.0F;
  const float bands = options.band_octaves > 0.0 ? static_cast<float>(1.0 / options.band_octaves) : 0.0F;
  keys_.resize(steps_.size());
  sorted_.resize(steps_.size());
  sorted_before_.resize(steps_.size());
  std::array<std::uint32_t, kDigits> low{};
  std::array<std::uint32_t, kDigits> high{};
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    keys_[i] = key_of(steps_[i].threshold, steps_[i].utility, anchor, bands);
    ++low[keys_[i] % kDigits];
    ++high[keys_[i] >> kDigitBits];
  }
  std::uint32_t low_sum = 0;
  std::uint32_t high_sum = 0;
  for (std::size_t d = 0; d < kDigits; ++d) {
    low_sum += std::exchange(low[d], low_sum);
    high_sum += std::exchange(high[d], high_sum);
  }
  for (std::uint32_t i = 0; i < steps_.size(); ++i) sorted_before_[low[keys_[i] % kDigits]++] = i;
  for (const std::uint32_t i : sorted_before_) sorted_[high[keys_[i] >> kDigitBits]++] = i;
}

void WantOrder::order(const WantInput& input, const PlanOptions& options, std::vector<Want>& wants) {
  wants.clear();
  collect(input, options);
  find_needs(input);
  share_costs();
  raise_needs();
  sort(options);
  wants.reserve(std::min<std::size_t>(steps_.size(), options.max_wants));
  for (const std::uint32_t i : sorted_) {
    if (wants.size() == options.max_wants) break;
    const Step& step = steps_[i];
    if (step.empty) continue;
    wants.push_back({step.cell, step.p, step.utility, input.live[step.cell] == 0});
  }
}

}  // namespace fanstream
