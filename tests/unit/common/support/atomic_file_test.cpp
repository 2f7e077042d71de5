#include "common/support/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>

#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

using testing::TemporaryFolder;

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::size_t entries(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

// Processes in containers often have the same number again.
TEST(AtomicFile, WhatAKilledProcessOfThisNumberLeftIsInNobodysWay) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "file";
  ASSERT_TRUE(write_file_atomically(path, bytes_of("first")));
  for (int serial = 0; serial < 60; ++serial) {
    folder.write("file.tmp-" + std::to_string(::getpid()) + "-" + std::to_string(serial), "left");
  }
  const std::size_t before = entries(folder.path());
  ASSERT_TRUE(write_file_atomically(path, bytes_of("second")));
  EXPECT_EQ(content(path), "second");
  EXPECT_EQ(entries(folder.path()), before);
}

TEST(AtomicFile, ReplacesTheWholeFileAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const auto path = folder.write("file", "something longer that was there before");
  ASSERT_TRUE(write_file_atomically(path, bytes_of("new")).has_value());
  EXPECT_EQ(content(path), "new");
  EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(AtomicFile, FullDiskIsAnErrorThatSaysWhatToDo) {
  const Result<void> written = write_file_atomically("/dev/full", bytes_of("x"));
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().kind, ErrorKind::io);
  EXPECT_NE(written.error().message.find("/dev/full: cannot write: No space left"), std::string::npos)
      << written.error().message;
}

// A file size limit fails in the middle of writing, as a full disk does.
TEST(AtomicFile, FailureInTheMiddleKeepsTheOldFileAndLeavesNothing) {
  const TemporaryFolder folder;
  const auto path = folder.write("file", "old");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{4096, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const Result<void> written = write_file_atomically(path, bytes_of(std::string(100'000, 'x')));
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().kind, ErrorKind::io);
  EXPECT_EQ(content(path), "old");
  EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(AtomicFile, MissingFolderAndFolderInPlaceOfAFileAreErrors) {
  const TemporaryFolder folder;
  const Result<void> missing = write_file_atomically(folder.path() / "no" / "file", bytes_of("x"));
  ASSERT_FALSE(missing.has_value());
  EXPECT_NE(missing.error().message.find("create the directory first"), std::string::npos) << missing.error().message;
  const Result<void> directory = write_file_atomically(folder.path(), bytes_of("x"));
  ASSERT_FALSE(directory.has_value());
  EXPECT_EQ(directory.error().kind, ErrorKind::io);
  EXPECT_EQ(entries(folder.path()), 0U);
}

}  // namespace
}  // namespace fanstream
