// Every limit of the protocol in one place. Both ends check them before they allocate. PROTOCOL.md lists the same
// values.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fanstream {

// Milliseconds on any monotonic clock; the sessions only ever look at differences.
using TimeMs = std::int64_t;

inline constexpr std::uint16_t kProtocolVersionMin = 2;
inline constexpr std::uint16_t kProtocolVersionMax = 2;
inline constexpr std::uint32_t kProtocolMagic = 0x534E4146;  // "FANS" read as a little-endian u32
inline constexpr std::uint16_t kDefaultPort = 7370;

inline constexpr std::size_t kFrameHeaderBytes = 4;  // u8 type, u24 payload size
inline constexpr std::size_t kMaxHelloBytes = 256;   // hello and welcome; more is never buffered before the handshake
inline constexpr std::size_t kMaxChunkBytes = 64 * 1024;       // blob bytes in one data frame
inline constexpr std::size_t kMaxDataFieldsBytes = 4 + 4 * 5;  // checksum and at most four varints of 32 bits
// Small segments are joined up to so many bytes: the first of a frame is of use only when the last has come (3 ms at 10
// Mbit/s), and the frame itself costs a quarter per cent.
inline constexpr std::size_t kBatchBytes = 4096;
inline constexpr std::size_t kMaxRunsBytes = 256 * 1024;  // wants, release and open
inline constexpr std::size_t kMaxCatalogueFrameBytes = 64 * 1024;
inline constexpr std::size_t kMaxNameBytes = 255;
inline constexpr std::size_t kMaxTextBytes = 1024;

inline constexpr std::uint32_t kMaxCells = 1U << 22;
inline constexpr std::uint32_t kMaxSegmentsPerCell = 65535;
inline constexpr std::uint32_t kMaxRuns = 65536;                 // runs in one list
inline constexpr std::uint64_t kMaxRunEntries = 1ULL << 26;      // cells over all runs of one list, repetitions counted
inline constexpr std::uint32_t kMaxSegmentBytes = 64U << 20;     // larger segments are refused on open
inline constexpr std::uint64_t kMaxHeadBytes = 1ULL << 30;       // head and index, each
inline constexpr std::uint64_t kMaxCredit = 1ULL << 40;          // outstanding at any time
inline constexpr std::uint32_t kMaxCatalogueEntries = 1U << 16;  // over all frames of one answer
inline constexpr std::uint32_t kMaxRefusals = 64;                // non-fatal errors a server forgives in one session

}  // namespace fanstream
