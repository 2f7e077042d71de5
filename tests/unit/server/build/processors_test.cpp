#include "server/build/processors.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace fanstream {
namespace {

TEST(Processors, ThereIsOneAtLeastAndNoMoreThanTheMachineHas) {
  EXPECT_GE(usable_processors(), 1U);
  const unsigned machine = std::thread::hardware_concurrency();  // 0 if it cannot tell
  EXPECT_TRUE(machine == 0 || usable_processors() <= machine);
}

TEST(Processors, EveryTaskRunsOnceOnAnyNumberOfThreads) {
  for (const unsigned threads : {0U, 1U, 2U, 5U}) {
    for (const std::size_t count : {0U, 1U, 3U, 100U}) {
      std::vector<std::atomic<int>> runs(count);
      run_side_by_side(threads, count, [&](std::size_t i) { ++runs[i]; });
      for (const std::atomic<int>& times : runs) EXPECT_EQ(times, 1) << threads << " threads, " << count << " tasks";
    }
  }
}

TEST(Processors, WhatATaskThrowsIsThrownAfterAllHaveEnded) {
  for (const unsigned threads : {1U, 3U}) {
    std::atomic<int> running{0};
    const auto run = [&] {
      run_side_by_side(threads, 20, [&](std::size_t i) {
        ++running;
        const std::string name = std::to_string(i);
        --running;
        if (i == 7) throw std::runtime_error(name);
      });
    };
    EXPECT_THROW(run(), std::runtime_error);
    EXPECT_EQ(running, 0);
  }
}

TEST(Processors, SmallModelsAreNotWorthAThread) {
  EXPECT_EQ(threads_worth_while(1000), 1U);
  EXPECT_EQ(threads_worth_while(1'000'000), usable_processors());
}

}  // namespace
}  // namespace fanstream
