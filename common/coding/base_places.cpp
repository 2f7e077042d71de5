#include "common/coding/base_places.h"

#include <algorithm>
#include <array>

#include "common/coding/rans.h"
#include "common/coding/split_model.h"

namespace fanstream {
namespace {

constexpr int kShareBits = 6;

// A table of exact or not, then each vertex, exact ones with their low bits.
template <class Coder>
void code_exact_places(Coder& coder, std::array<std::uint8_t, 2> shares, const PlaceLattice& lattice,
                       std::span<GridPoint> places, std::span<std::uint8_t> exact) {
  for (std::uint8_t& share : shares) share = static_cast<std::uint8_t>(coder.bits(kShareBits, share));
  const FrequencyTable table = table_of(shares);
  const LatticeStep step(lattice);
  for (std::size_t v = 0; v < places.size(); ++v) {
    exact[v] = static_cast<std::uint8_t>(coder.symbol(table, exact[v]));
    if (exact[v] == 0) continue;
    const LowBits low = step.code(coder, Coder::kDecodes ? 0 : step.low_bits_of(places[v]));
    if constexpr (Coder::kDecodes) places[v] = step.fine(places[v], low);
  }
}

}  // namespace

BaseMesh base_on_lattice(const BaseMesh& base, const PlaceLattice& lattice) {
  BaseMesh result = base;
  for (GridPoint& place : result.places) place = lattice.point_of(place);
  return result;
}

std::vector<std::byte> encode_exact_places(std::span<const GridPoint> places, std::span<const std::uint8_t> exact,
                                           const PlaceLattice& lattice) {
  const auto count = static_cast<double>(std::count(exact.begin(), exact.end(), 1));
  if (count == 0.0) return {};
  const auto sum = static_cast<double>(exact.size());
  std::vector<GridPoint> codes(places.begin(), places.end());
  std::vector<std::uint8_t> flags(exact.begin(), exact.end());
  RansEncoder encoder;
  code_exact_places(encoder, {coded_share(sum - count, sum), coded_share(count, sum)}, lattice, codes, flags);
  return encoder.finish();
}

Result<std::vector<std::uint8_t>> decode_exact_places(std::span<const std::byte> bytes, const PlaceLattice& lattice,
                                                      std::span<GridPoint> places) {
  std::vector<std::uint8_t> exact(places.size(), 0);
  if (!bytes.empty()) {
    RansDecoder decoder(bytes);
    code_exact_places(decoder, {}, lattice, places, exact);
    if (!decoder.finished_cleanly()) return fail(ErrorKind::bad_input, "damaged exact places");
  }
  for (std::size_t v = 0; v < places.size(); ++v) {
    if (exact[v] == 0) places[v] = lattice.code_of(places[v]);
  }
  return exact;
}

}  // namespace fanstream
