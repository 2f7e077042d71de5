// The statistics that FanSplits are coded with: one set per asset, built-in where an asset is too small to pay for its
// own.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/coding/frequency_table.h"
#include "common/coding/residual_tables.h"
#include "common/support/byte_io.h"
#include "common/support/result.h"

namespace fanstream {

// How a root's ring lies to the outside: closed, or open with kOutside as a wing, on the new vertex's side, or on the
// other.
enum class Opening : std::uint8_t { closed = 0, wing = 1, taken = 2, left = 3 };

// Whose next split is told: a vertex's of FM0, the root's of a split, or the vertex's that the split added.
enum class NextSplitOf : std::uint8_t { root = 0, added = 1, base = 2 };

// What is known where a symbol is coded: its context, clamped into range. Contexts that behave alike, in generations of
// a phase, share one of fewer tables: a decoder's nearest memory holds those in use.
struct SymbolContexts {
  static constexpr int kRingClasses = 13;  // ring sizes 3..14, then more
  static constexpr int kValences = 12;     // up to 3, 4..13, then more
  static constexpr std::uint32_t kManyFree = 6;
  static constexpr int kNextContexts = (static_cast<int>(kManyFree) * 2 * 2 + 1) * kValences;
  static constexpr int kOpeningFirst = kNextContexts;
  static constexpr int kLengthFirst = kOpeningFirst + kRingClasses;
  static constexpr int kRankFirst = kLengthFirst + 4 * kRingClasses;
  static constexpr int kParentFirst = kRankFirst + kRingClasses * 8;
  static constexpr int kContexts = kParentFirst + 4;
  static constexpr int kTables = 128;  // for all contexts and phases

  static int ring_class(std::uint32_t size) { return size < 3 ? 0 : size > 15 ? 12 : static_cast<int>(size) - 3; }
  // When a vertex is split next, from what is left to choose from: how many generations are free (at least 1), and
  // whether the very next is taken.
  static int next_split(NextSplitOf whose, std::uint32_t free, bool next_taken, std::uint32_t valence) {
    const int by_valence = valence < 3 ? 0 : valence > 14 ? 11 : static_cast<int>(valence) - 3;
    if (whose == NextSplitOf::base) return kNextContexts - kValences + by_valence;
    const int by_free = static_cast<int>(free < kManyFree ? free : kManyFree) - 1;
    return ((by_free * 2 + static_cast<int>(whose)) * 2 + (next_taken ? 1 : 0)) * kValences + by_valence;
  }
  static int opening(std::uint32_t ring) { return kOpeningFirst + ring_class(ring); }
  static int length(Opening opening, std::uint32_t ring) {
    return kLengthFirst + static_cast<int>(opening) * kRingClasses + ring_class(ring);
  }
  static int rank(std::uint32_t ring, std::uint32_t length) {
    return kRankFirst + ring_class(ring) * 8 + static_cast<int>(length < 8 ? length - 1 : 7);
  }
  static int parent(bool last_of_patch, bool open) { return kParentFirst + (last_of_patch ? 0 : 2) + (open ? 1 : 0); }
  static int symbol_count(int context, bool free_parents = false);

  // The built-in choice of a table for each context. Contexts of one table have equally many symbols, and those of
  // parents a table of their own.
  static int table_of(int phase, int context);
  static int table_symbol_count(int table, bool free_parents = false);
  static bool is_of_parents(int table);
};

// How far a generation is from the asset's last: 0 that one, 1 the one before, 2 the two before these, 3 all others and
// FM0. The last ones restore a mesh as it was made, the first ones a simplifier's.
struct CodingPhase {
  static constexpr int kPhases = 4;
  static constexpr int kFirst = kPhases - 1;
  static constexpr int of(std::uint32_t generation, std::uint32_t last) {
    const std::uint32_t left = last - generation;
    return left < 2 ? static_cast<int>(left) : left < 4 ? 2 : kFirst;
  }
};

// Linear prediction of the place of the centre that a split reveals, from four features of the ring
// (RingFeatures); weights in 64ths. By what is predicted, by opening and by arc length.
struct PredictionContexts {
  static constexpr int kFeatures = 4;
  static constexpr int kArcClasses = 8;
  static constexpr int kClasses = 2 * 2 * kArcClasses;
  static int index(bool middle, bool open, std::uint32_t arc) {
    const int arc_class = static_cast<int>(arc < kArcClasses ? arc : kArcClasses) - 1;
    return ((middle ? 1 : 0) * 2 + (open ? 1 : 0)) * kArcClasses + arc_class;
  }
};

// Expected size of what the prediction leaves, as 8ths of a binary logarithm of grid steps: along the predicted
// direction and across it by the ring's mean square spoke, along the normal by its bend square and by the two's ratio.
// All three times a factor of the prediction's class, as 8ths of a binary logarithm too.
struct SpreadContexts {
  static constexpr int kSizes = 28;  // half octaves from 2^-2
  static constexpr int kRatios = 3;
  static constexpr int kAlong = 0;
  static constexpr int kAcross = kSizes;
  static constexpr int kNormal = 2 * kSizes;
  static constexpr int kSpreads = kNormal + kSizes * kRatios;
  // From squared sizes.
  static int size_class(float square) {
    const int exponent = static_cast<int>(std::bit_cast<std::uint32_t>(square) >> 23U) - 127 + 4;
    return exponent < 0 ? 0 : exponent < kSizes ? exponent : kSizes - 1;
  }
  static int normal(float bend_square, float mean_square) {
    const int ratio =
        static_cast<int>(bend_square * 256.0F >= mean_square) + static_cast<int>(bend_square * 25.0F >= mean_square);
    return kNormal + ratio * kSizes + size_class(bend_square);
  }
};

// The shift of a free parent: predicted from the same features of the ring, with weights in 64ths; what that leaves, by
// its spread in 8ths of an octave: along the displacement and across it as shares of its length, and along the normal
// as a share of the ring's bend.
struct FreeParentStatistics {
  std::array<std::int8_t, PredictionContexts::kFeatures> weights{};
  std::array<std::int8_t, 3> spreads{};
  bool operator==(const FreeParentStatistics&) const = default;
};

// The numbers that a model is made of, as they are stored: for each symbol of each table -4 log2 of its share (0..63);
// by phase and class the prediction weights in 64ths and the factors of spreads in 8ths; and the spreads in 8ths.
struct SplitStatistics {
  static constexpr std::uint8_t kLeastShare = 63;
  static constexpr std::size_t kClasses = std::size_t{CodingPhase::kPhases} * PredictionContexts::kClasses;
  std::array<std::array<std::uint8_t, FrequencyTable::kMaxSymbols>, SymbolContexts::kTables> symbols{};
  std::array<std::array<std::int8_t, PredictionContexts::kFeatures>, kClasses> weights{};
  std::array<std::int8_t, kClasses> scales{};
  std::array<std::int8_t, SpreadContexts::kSpreads> spreads{};
  bool has_free_parents = false;  // only then parents have a fourth symbol, and the next line is of meaning
  FreeParentStatistics free_parent;

  static std::size_t class_of(int phase, int prediction) {
    return static_cast<std::size_t>(phase * PredictionContexts::kClasses + prediction);
  }
  // From statistics without free parents: gives the fourth symbol and the rest their first values.
  void allow_free_parents();
  static const SplitStatistics& built_in();
  // Writes what differs from the built-in statistics. read() fails on anything malformed and names the byte.
  void write(ByteWriter& out) const;
  static Result<SplitStatistics> read(ByteReader& in);
  // Bits that a table's own shares take in what is written, or its staying as it is built in.
  static double table_bits(std::span<const std::uint8_t> shares, std::span<const std::uint8_t> built_in);
};

// -4 log2 of each count's share of their sum, as SplitStatistics keeps it.
std::uint8_t coded_share(double count, double sum);
// The table that coded shares stand for.
FrequencyTable table_of(std::span<const std::uint8_t> coded_shares);

// What the generations of one phase are coded with.
struct PhaseModel {
  std::array<const FrequencyTable*, SymbolContexts::kContexts> tables{};
  std::array<std::array<float, PredictionContexts::kFeatures>, PredictionContexts::kClasses> weights{};
  std::array<float, PredictionContexts::kClasses> scales{};  // of variances
  std::array<float, SpreadContexts::kSpreads> variances{};   // squared spreads in grid steps
  bool has_free_parents = false;
  std::array<float, PredictionContexts::kFeatures> shift_weights{};
  std::array<float, 3> shift_variances{};  // shares

  const ResidualTables& residuals = ResidualTables::instance();
  const FrequencyTable& table(std::size_t context) const { return *tables[context]; }
};

// Ready to code with. Immutable once made; thread safe to read.
class SplitModel {
 public:
  explicit SplitModel(const SplitStatistics& statistics = SplitStatistics::built_in());
  // With a table for each context of each phase, as they are built in; index_of counts contexts, phase by phase.
  static SplitModel untied();
  SplitModel(const SplitModel&) = delete;
  SplitModel& operator=(const SplitModel&) = delete;

  const PhaseModel& phase(int phase) const { return phases_[static_cast<std::size_t>(phase)]; }
  const PhaseModel& at(std::uint32_t generation, std::uint32_t last) const {
    return phase(CodingPhase::of(generation, last));
  }
  // The number of a table that it codes with; table_count() of any other.
  std::size_t index_of(const FrequencyTable& table) const;
  std::size_t table_count() const { return table_count_; }

 private:
  struct Untied {};
  explicit SplitModel(Untied);
  void use(const SplitStatistics& statistics);

  std::array<PhaseModel, CodingPhase::kPhases> phases_;
  std::size_t table_count_ = SymbolContexts::kTables;
  std::vector<FrequencyTable> own_tables_;
  std::vector<std::size_t> own_;  // their numbers
};

}  // namespace fanstream
