// fanstream-client as a user runs it: what tests of its commands share.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/support/result.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace fanstream::testing {

class ClientProgramTest : public ::testing::Test {
 protected:
  // `command` comes before all arguments; none where it is empty.
  explicit ClientProgramTest(std::string command = {}) : command_(std::move(command)) {}

  ProgramOutcome run(std::vector<std::string> arguments) const {
    if (!command_.empty()) arguments.insert(arguments.begin(), command_);
    return run_program("fanstream-client", arguments);
  }
  nlohmann::json run_json(std::vector<std::string> arguments) const {
    arguments.emplace_back("--json");
    const ProgramOutcome outcome = run(std::move(arguments));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
  static void expect_failure(const ProgramOutcome& outcome, ErrorKind kind, const std::string& text) {
    EXPECT_EQ(outcome.exit_code, exit_code(kind)) << outcome.error;
    EXPECT_NE(outcome.error.find(text), std::string::npos) << outcome.error;
    EXPECT_EQ(outcome.out, "");
  }
  // Of a --help: an example, and no line beyond 80 columns.
  static void expect_help(const ProgramOutcome& outcome) {
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_NE(outcome.out.find("Example"), std::string::npos);
    std::istringstream lines(outcome.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  }
  std::string out(const std::string& name) const { return (folder.path() / name).string(); }
  static std::string contents(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  TemporaryFolder folder;

 private:
  std::string command_;
};

}  // namespace fanstream::testing
