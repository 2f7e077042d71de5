// Runs the programs that are delivered, as a shell would.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace fanstream::testing {

struct ProgramOutcome {
  int exit_code = -1;  // 128 + signal if it was killed
  std::string output;
  std::string errors;
};

class Program {
 public:
  // `name` in build/bin. What it writes goes to nameless temporary files.
  Program(const std::string& name, const std::vector<std::string>& arguments);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void send_signal(int signal) const;
  // What it has written to standard error so far.
  std::string errors_so_far() const;
  // Kills it after 60 s.
  ProgramOutcome wait();

 private:
  pid_t process_ = -1;
  int output_ = -1, errors_ = -1;
};

inline ProgramOutcome run_program(const std::string& name, const std::vector<std::string>& arguments) {
  return Program(name, arguments).wait();
}

}  // namespace fanstream::testing
