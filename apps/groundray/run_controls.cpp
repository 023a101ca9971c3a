#include "apps/groundray/run_controls.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

namespace groundray {
namespace {

constexpr std::size_t most_threads = 1024;

// Standard error is redirected as a whole: libraries print there, too.
int silence_stderr() {
  std::fflush(stderr);
  const int shown = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (shown < 0 || nowhere < 0 || dup2(nowhere, STDERR_FILENO) < 0)
    throw std::system_error(errno, std::generic_category(), "--quiet");
  close(nowhere);
  return shown;
}

}  // namespace

void RunControls::add(CLI::App* command) {
  command
      ->add_option("--threads", threads,
                   "Most threads that compute (all cores); results are the same for any number")
      ->check(CLI::Range(std::size_t{1}, most_threads));
  command->add_flag("-q,--quiet", is_quiet,
                    "Print no progress and no notes on standard error, only the error that ends "
                    "the command");
  command->add_flag("--network", is_network_open,
                    "Permit rasters on servers: /vsicurl/https://..., /vsis3/BUCKET/...; as "
                    "$GROUNDRAY_NETWORK=1");
}

AppliedControls::AppliedControls(const RunControls& controls) {
  if (controls.threads)
    threads_.emplace(tbb::global_control::max_allowed_parallelism, *controls.threads);
  if (controls.is_quiet) shown_ = silence_stderr();
  if (controls.is_network_open) setenv("GROUNDRAY_NETWORK", "1", 1);
}

AppliedControls::~AppliedControls() {
  if (shown_ < 0) return;
  std::fflush(stderr);
  dup2(shown_, STDERR_FILENO);
  close(shown_);
}

}  // namespace groundray
