#include "common/support/free_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstddef>
#include <cstring>
#include <fstream>
#include <memory>
#include <vector>

namespace fanstream {
namespace {

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
constexpr bool kIsGlibcs = true;  // the allocator
#else
constexpr bool kIsGlibcs = false;
#endif

std::size_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t all = 0;
  std::size_t resident = 0;
  file >> all >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

// Many small pieces, of which every eighth is kept: what is free lies between what is not.
TEST(FreeMemory, IsGivenBackAndWhatIsInUseStays) {
  constexpr std::size_t kBytes = 8000;
  std::vector<std::unique_ptr<unsigned char[]>> pieces(2000);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    pieces[i].reset(new unsigned char[kBytes]);
    std::memset(pieces[i].get(), static_cast<int>(i % 251), kBytes);
  }
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (i % 8 != 0) pieces[i].reset();
  }
  const std::size_t before = resident_bytes();
  give_back_free_memory();
  if (kIsGlibcs && before != 0) {
    EXPECT_LT(resident_bytes() + pieces.size() * kBytes / 2, before);
  }
  for (std::size_t i = 0; i < pieces.size(); i += 8) {
    for (std::size_t b = 0; b < kBytes; ++b) ASSERT_EQ(pieces[i][b], i % 251);
  }
}

}  // namespace
}  // namespace fanstream
