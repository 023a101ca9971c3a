#include "apps/golden/suite/process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <system_error>

#include "core/error.h"

namespace groundray::golden {
namespace {

// Redirects standard output and standard error to a file.
class ToFile {
 public:
  explicit ToFile(const std::filesystem::path& log) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, log.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
  }
  ~ToFile() { posix_spawn_file_actions_destroy(&actions_); }
  ToFile(const ToFile&) = delete;
  ToFile& operator=(const ToFile&) = delete;

  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

}  // namespace

int run_process(const std::vector<std::string>& command, const std::filesystem::path& log) {
  if (!std::ofstream(log)) throw Error("{}: cannot be written", log.string());
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const ToFile to_file(log);
  pid_t child = 0;
  const int fault =
      posix_spawn(&child, arguments[0], to_file.get(), nullptr, arguments.data(), environ);
  if (fault != 0) {
    throw Error("{}: cannot be started: {}", command[0], std::generic_category().message(fault));
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw Error("{}: waiting for the process failed", command[0]);
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace groundray::golden
