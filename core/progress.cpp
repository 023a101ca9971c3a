#include "core/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <utility>

namespace groundray {
namespace {

using std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

std::string rate_text(double rate_hz) {
  if (rate_hz >= 100) return fmt::format("{:.0f}/s", rate_hz);
  if (rate_hz >= 1) return fmt::format("{:.1f}/s", rate_hz);
  return fmt::format("{:.2g}/s", rate_hz);
}

}  // namespace

Progress::Progress(std::FILE* out, std::string label, std::uint64_t total)
    : out_(out),
      terminal_(out != nullptr && isatty(fileno(out)) == 1),
      label_(std::move(label)),
      total_(total),
      begin_(steady_clock::now()),
      reported_(begin_) {
  if (terminal_) draw(fmt::format("{} 0/{}", label_, total_));
}

Progress::~Progress() {
  if (terminal_ && !finished_) std::fputc('\n', out_);
}

// Returns true if a new line is due, and begins the pause before the next.
bool Progress::is_due() {
  constexpr std::chrono::milliseconds terminal_pause(100), plain_pause(5000);
  const auto now = steady_clock::now();
  if (out_ == nullptr || finished_) return false;
  if (now - reported_ < (terminal_ ? terminal_pause : plain_pause)) return false;
  reported_ = now;
  return true;
}

void Progress::show(const std::function<std::string()>& line) {
  if (is_due()) draw(line());
}

void Progress::end(const std::string& line) {
  if (out_ == nullptr || finished_) return;
  finished_ = true;
  draw(fmt::format("{} in {}", line, duration_text(steady_clock::now() - begin_)));
}

void Progress::update(std::uint64_t done) {
  const auto count = [&] { return fmt::format("{} {}/{}", label_, done, total_); };
  if (done >= total_) return end(count());
  if (!is_due()) return;
  const Seconds spent = steady_clock::now() - begin_;
  std::string line = count();
  if (done > 0) {
    const Seconds left = spent * (static_cast<double>(total_ - done) / static_cast<double>(done));
    line += fmt::format(", {}, {} left", rate_text(static_cast<double>(done) / spent.count()),
                        duration_text(left));
  }
  draw(line);
}

void Progress::draw(const std::string& line) {
  const char* const end = terminal_ && !finished_ ? "" : "\n";
  // Blanks overwrite the rest of a longer line.
  const std::string text =
      terminal_ ? fmt::format("\r{:<{}}{}", line, drawn_width_, end) : line + end;
  std::fputs(text.c_str(), out_);
  std::fflush(out_);
  drawn_width_ = line.size();
}

std::string duration_text(std::chrono::duration<double> duration) {
  const double seconds = std::round(duration.count());
  if (duration.count() < 0.95) return fmt::format("{:.1f} s", duration.count());
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  if (seconds < 3600)
    return fmt::format("{:.0f} min {:.0f} s", std::floor(seconds / 60), std::fmod(seconds, 60));
  const double minutes = std::round(duration.count() / 60);
  return fmt::format("{:.0f} h {:.0f} min", std::floor(minutes / 60), std::fmod(minutes, 60));
}

}  // namespace groundray
