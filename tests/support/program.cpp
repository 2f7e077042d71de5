#include "tests/support/program.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <iterator>
#include <thread>

namespace fanstream::testing {
namespace {

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

Program::Program(const std::string& name, const std::vector<std::string>& arguments) {
  const std::string path = FANSTREAM_BIN_DIR "/" + name;
  std::vector<char*> argv{const_cast<char*>(path.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const std::string out = folder_.path() / "out";
  const std::string error = folder_.path() / "error";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, error.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (posix_spawn(&process_, path.c_str(), &actions, nullptr, argv.data(), environ) != 0) {
    posix_spawn_file_actions_destroy(&actions);
    throw std::runtime_error("cannot start " + path);
  }
  posix_spawn_file_actions_destroy(&actions);
}

Program::~Program() {
  if (ended()) return;
  ::kill(process_, SIGKILL);
  ::waitpid(process_, &status_, 0);
}

std::string Program::out() const { return content(folder_.path() / "out"); }
std::string Program::error() const { return content(folder_.path() / "error"); }

bool Program::ended() {
  if (process_ > 0 && ::waitpid(process_, &status_, WNOHANG) == process_) process_ = 0;
  return process_ == 0;
}

bool Program::wait_for_output(const std::string& text) {
  const auto last = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (std::chrono::steady_clock::now() < last) {
    const bool over = ended();
    if (out().find(text) != std::string::npos) return true;
    if (over) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

void Program::signal(int number) const {
  if (process_ > 0) ::kill(process_, number);
}

ProgramOutcome Program::wait() {
  if (process_ > 0) {
    ::waitpid(process_, &status_, 0);
    process_ = 0;
  }
  const int code = WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  return {code, out(), error()};
}

ProgramOutcome run_program(const std::string& name, const std::vector<std::string>& arguments) {
  return Program(name, arguments).wait();
}

}  // namespace fanstream::testing
