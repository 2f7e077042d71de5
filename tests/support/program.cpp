#include "tests/support/program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>

namespace fanstream::testing {
namespace {

std::string contents(int descriptor) {
  std::string text;
  char part[4096];
  off_t at = 0;
  for (ssize_t size = 0; (size = ::pread(descriptor, part, sizeof part, at)) > 0; at += size) {
    text.append(part, static_cast<std::size_t>(size));
  }
  return text;
}

}  // namespace

Program::Program(const std::string& name, const std::vector<std::string>& arguments)
    : output_(::memfd_create("output", MFD_CLOEXEC)), errors_(::memfd_create("errors", MFD_CLOEXEC)) {
  const std::string path = std::string(FANSTREAM_BIN_DIR) + "/" + name;
  std::vector<char*> list{const_cast<char*>(path.c_str())};
  for (const std::string& argument : arguments) list.push_back(const_cast<char*>(argument.c_str()));
  list.push_back(nullptr);
  process_ = ::fork();
  if (process_ < 0) throw std::runtime_error("fork failed");
  if (process_ == 0) {
    ::dup2(output_, STDOUT_FILENO);
    ::dup2(errors_, STDERR_FILENO);
    ::alarm(60);  // outlives exec: a program that hangs is killed
    ::execv(path.c_str(), list.data());
    ::_exit(127);
  }
}

Program::~Program() {
  if (process_ > 0) {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  ::close(output_);
  ::close(errors_);
}

void Program::send_signal(int signal) const { ::kill(process_, signal); }

std::string Program::errors_so_far() const { return contents(errors_); }

ProgramOutcome Program::wait() {
  int status = 0;
  ::waitpid(process_, &status, 0);
  process_ = -1;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), contents(output_), contents(errors_)};
}

}  // namespace fanstream::testing
