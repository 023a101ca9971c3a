#include "apps/scene/interruption.h"

#include <csignal>

namespace groundray {
namespace {

volatile std::sig_atomic_t requested = 0;

void request(int signal) {
  requested = 1;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void catch_interruptions() {
  std::signal(SIGINT, request);
  std::signal(SIGTERM, request);
  if (std::signal(SIGHUP, request) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);  // by nohup
}

bool is_interrupted() noexcept { return requested != 0; }

void stop_if_interrupted() {
  if (is_interrupted()) throw Interrupted{};
}

}  // namespace groundray
