#include "apps/dataset/write/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "apps/dataset/file_sum.h"
#include "core/error.h"
#include "core/io/open_file.h"

namespace groundray {
namespace {

constexpr std::size_t mark_digits = 16;

std::string mark_of(std::string_view entry) { return sha256_of(entry).substr(0, mark_digits); }

[[noreturn]] void fail_to(const char* what, const std::filesystem::path& path) {
  const int fault = errno;
  throw Error("{}: cannot be {}: {}; check the disk's space and the folder's permissions",
              path.string(), what, std::generic_category().message(fault));
}

}  // namespace

Journal::Journal(std::filesystem::path path)
    : path_(std::move(path)), synced_(std::chrono::steady_clock::now()) {
  try {
    descriptor_ = create_file(path_);
  } catch (const std::system_error& fault) {
    errno = fault.code().value();
    fail_to("written", path_);
  }
}

Journal::~Journal() { close(descriptor_); }

std::uint64_t Journal::add(std::string_view entry) {
  constexpr std::chrono::seconds most_lost(5);
  const std::string line = fmt::format("{} {}\n", mark_of(entry), entry);
  const std::uint64_t place = size_bytes_;
  const auto written = pwrite(descriptor_, line.data(), line.size(), static_cast<off_t>(place));
  if (written >= 0 && std::cmp_less(written, line.size())) errno = ENOSPC;  // the disk is full
  if (!std::cmp_equal(written, line.size())) fail_to("written", path_);
  size_bytes_ += line.size();
  const auto now = std::chrono::steady_clock::now();
  if (now - synced_ < most_lost) return place;
  if (fdatasync(descriptor_) != 0) fail_to("written", path_);
  synced_ = now;
  return place;
}

std::string Journal::at(std::uint64_t place) const {
  std::string line;
  std::array<char, 4096> block{};
  while (line.find('\n') == std::string::npos) {
    const auto read =
        pread(descriptor_, block.data(), block.size(), static_cast<off_t>(place + line.size()));
    if (read <= 0) fail_to("read", path_);
    line.append(block.data(), static_cast<std::size_t>(read));
  }
  line.resize(line.find('\n'));
  return line.substr(mark_digits + 1);
}

void Journal::rename_to(const std::filesystem::path& path) {
  if (fdatasync(descriptor_) != 0 || std::rename(path_.c_str(), path.c_str()) != 0)
    fail_to("written", path);
  path_ = path;
}

void Journal::remove() noexcept {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

std::size_t read_journal(const std::filesystem::path& path,
                         const std::function<void(const std::string& entry)>& take) {
  std::ifstream file = open_stream(path);
  if (!file) throw Error("{}: {}", path.string(), why_not_read(path, errno));
  std::size_t unreadable = 0;
  for (std::string line; next_line(file, line);) {
    const std::size_t blank = line.find(' ');
    const std::string entry = blank == mark_digits ? line.substr(blank + 1) : "";
    if (!entry.empty() && line.starts_with(mark_of(entry)))
      take(entry);
    else
      ++unreadable;
  }
  if (file.bad()) throw Error("{}: {}", path.string(), why_not_read(path, EIO));
  return unreadable;
}

void count_journal(const std::filesystem::path& path, DatasetSummary& dataset) {
  dataset.done = 0;
  for (DatasetSummary::Sensor& sensor : dataset.sensors) {
    sensor.done = sensor.bytes = 0;
    sensor.counted.clear();
  }
  read_journal(path, [&](const std::string& text) {
    if (const auto entry = parse_entry(text)) dataset.add(*entry);
  });
}

}  // namespace groundray
