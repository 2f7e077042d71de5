#include "server/build/processors.h"

#include <gtest/gtest.h>

#include <thread>

namespace fanstream {
namespace {

TEST(Processors, ThereIsOneAtLeastAndNoMoreThanTheMachineHas) {
  EXPECT_GE(usable_processors(), 1U);
  const unsigned machine = std::thread::hardware_concurrency();  // 0 if it cannot tell
  EXPECT_TRUE(machine == 0 || usable_processors() <= machine);
}

}  // namespace
}  // namespace fanstream
