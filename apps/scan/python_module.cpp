// Starts Python for files that only its libraries read: bags, LAS. The exit codes are those of
// apps/python/groundray/foreign/module.py; Python itself exits with 1 after an exception, 2 on
// wrong usage. `-P` keeps the current folder, which may hold anybody's numpy.py, out of the path of
// modules.
#include "apps/scan/python_module.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/error.h"

namespace groundray {
namespace {

constexpr int module_failed = 3, package_missing = 4, lost = -1;
constexpr std::string_view remedy =
    "`pip install '.[export]'` in groundray's sources installs it; $GROUNDRAY_PYTHON names another "
    "interpreter";

// A pipe. Its ends are closed on destruction, and are not inherited by programs started meanwhile.
struct Pipe {
  std::array<int, 2> ends{-1, -1};

  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0)
      throw Error("a pipe cannot be made: {}", std::generic_category().message(errno));
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  void close_end(std::size_t which) {
    if (ends[which] >= 0) close(ends[which]);
    ends[which] = -1;
  }
};

// A child process; killed on destruction if it still runs.
class Child {
 public:
  // Starts a program of PATH; standard input is empty. `fault` is an errno, or 0.
  Child(const std::vector<std::string>& command, const Pipe& out, const Pipe& err) {
    std::vector<char*> words;
    for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    posix_spawn_file_actions_t files{};
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&files, out.ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&files, err.ends[1], STDERR_FILENO);
    fault_ = posix_spawnp(&id_, words[0], &files, nullptr, words.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    if (fault_ != 0) id_ = 0;
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (id_ == 0) return;
    kill(id_, SIGKILL);
    wait();
  }

  int fault() const { return fault_; }

  // Returns the exit code, 128 plus the number of the signal that ended it, or `lost`.
  int wait() {
    const pid_t id = std::exchange(id_, 0);
    int status = 0;
    pid_t ended;
    do {
      ended = waitpid(id, &status, 0);
    } while (ended < 0 && errno == EINTR);
    if (ended != id) return lost;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  pid_t id_ = 0;
  int fault_ = 0;
};

// Reads what is there; closes the pipe at its end.
void read_some(Pipe& pipe, std::string& text) {
  std::array<char, 1 << 16> block{};
  const ssize_t count = read(pipe.ends[0], block.data(), block.size());
  if (count < 0 && errno == EINTR) return;
  if (count <= 0) return pipe.close_end(0);
  text.append(block.data(), static_cast<std::size_t>(count));
}

// Reads both pipes to their ends. @return false if there is too much.
bool read_both(Pipe& out, Pipe& err, std::string& printed, std::string& errors,
               const ProcessLimits& limits) {
  constexpr int wait_ms = 100;
  while (out.ends[0] >= 0 || err.ends[0] >= 0) {
    std::array<pollfd, 2> both{{{out.ends[0], POLLIN, 0}, {err.ends[0], POLLIN, 0}}};
    const int ready = poll(both.data(), both.size(), wait_ms);
    if (ready < 0 && errno != EINTR)
      throw Error("waiting for Python failed: {}", std::generic_category().message(errno));
    if (limits.check) limits.check();
    if (ready <= 0) continue;
    if (both[0].revents != 0) read_some(out, printed);
    if (both[1].revents != 0) read_some(err, errors);
    if (static_cast<double>(printed.size() + errors.size()) > limits.most_bytes) return false;
  }
  return true;
}

// Returns the last line, where Python states an exception.
std::string last_line(std::string_view text) {
  while (text.ends_with('\n')) text.remove_suffix(1);
  const std::size_t end = text.rfind('\n');
  return std::string(end == std::string_view::npos ? text : text.substr(end + 1));
}

// Returns why the process failed, in one line.
std::string reason_of(int code, const std::string& errors, const std::string& python) {
  std::string line = last_line(errors);
  if (code == lost) return fmt::format("the exit code of {} is lost: is SIGCHLD ignored?", python);
  if (code == 128 + SIGINT || (code == module_failed && line.empty()))
    return "reading was interrupted";
  if (code == module_failed) return line;
  if (code == package_missing) return fmt::format("{} ({})", line, python);
  if (errors.find("No module named groundray") != std::string::npos ||
      errors.find("No module named 'groundray") != std::string::npos)
    return fmt::format("groundray's Python package reads it, which {} does not have: {}", python,
                       remedy);
  if (code > 128)
    return fmt::format("{} was ended by signal {} while it read the file: is it damaged?", python,
                       code - 128);
  return fmt::format(
      "groundray's Python package reads it, which needs Python 3.11 or newer and could not be run "
      "by {} ({}): {}",
      python, line.empty() ? fmt::format("exit code {}", code) : line, remedy);
}

}  // namespace

std::string run_python_module(const std::string& module, const std::vector<std::string>& words,
                              const std::filesystem::path& subject, const ProcessLimits& limits) {
  const char* const named = std::getenv("GROUNDRAY_PYTHON");
  const std::string python = named != nullptr && *named != '\0' ? named : "python3";
  std::vector<std::string> command{python, "-P", "-m", module};
  command.insert(command.end(), words.begin(), words.end());
  Pipe out, err;
  Child child(command, out, err);
  if (child.fault() != 0) {
    throw Error("{}: groundray's Python package reads it, but {} cannot be started ({}): {}",
                subject.string(), python, std::generic_category().message(child.fault()), remedy);
  }
  out.close_end(1);
  err.close_end(1);
  std::string printed, errors;
  if (!read_both(out, err, printed, errors, limits))
    throw Error("{}: what was read of it exceeds {:.0f} MiB: is it damaged?", subject.string(),
                limits.most_bytes / (1 << 20));
  const int code = child.wait();
  if (code != 0) throw Error("{}: {}", subject.string(), reason_of(code, errors, python));
  return printed;
}

}  // namespace groundray
