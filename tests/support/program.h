// Runs the real programs of build/bin and looks at what they say.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace fanstream::testing {

struct ProgramOutcome {
  int exit_code = -1;  // 128 + the signal's number if one ended it
  std::string out;
  std::string error;
};

// A program that runs in the background; ended by its destructor if need be.
class Program {
 public:
  // `name` without folder: "fanstream-server". Standard input is empty.
  Program(const std::string& name, const std::vector<std::string>& arguments);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  std::string out() const;  // what it has written so far
  std::string error() const;
  // Waits until standard output holds the text; false if the program ends, or after a minute.
  bool wait_for_output(const std::string& text);
  void signal(int number) const;
  ProgramOutcome wait();  // until it ends

 private:
  bool ended();

  TemporaryFolder folder_;
  pid_t process_ = -1;
  int status_ = 0;
};

ProgramOutcome run_program(const std::string& name, const std::vector<std::string>& arguments);

}  // namespace fanstream::testing
