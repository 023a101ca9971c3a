#include "core/product_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/png_bytes.h"
#include "core/text_lines.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

[[noreturn]] void throw_system_error() { throw std::system_error(errno, std::generic_category()); }

std::string_view way_to_write(const std::error_code& fault) {
  if (fault == std::errc::no_space_on_device) return "free some space or write to another disk";
  if (fault == std::errc::file_too_large) return "raise the limit on file sizes (ulimit -f)";
  if (fault == std::errc::no_such_file_or_directory) return "make its folder first";
  if (fault == std::errc::not_a_directory) return "a part of its path is a file: choose another";
  if (fault == std::errc::filename_too_long) return "choose a shorter name";
  if (fault == std::errc::too_many_files_open) return "raise the limit on open files (ulimit -n)";
  if (fault == std::errc::permission_denied || fault == std::errc::operation_not_permitted ||
      fault == std::errc::read_only_file_system) {
    return "choose a folder that you may write to";
  }
  return "check the path, the disk and its quota";
}

/// Half of what the type holds, so that differences fit too.
constexpr nanoseconds latest_time = nanoseconds::max() / 2;

/// Returns the decimal number of seconds `word`, rounded to a nanosecond: by way of a double,
/// 1600000000.123456789 would lose its last two digits. Nothing if it is no number or lies beyond
/// latest_time.
std::optional<nanoseconds> parse_seconds(std::string_view word) {
  const bool negative = word.starts_with('-');
  if (negative || word.starts_with('+')) word.remove_prefix(1);
  std::ptrdiff_t exponent = 9;  // the value is `digits` times ten to this power, in ns
  if (const std::size_t e = word.find_first_of("eE"); e != std::string_view::npos) {
    const auto written = number_of<std::int16_t>(word.substr(e + 1));
    if (!written) return std::nullopt;
    exponent += *written;
    word = word.substr(0, e);
  }
  std::string digits(word);
  if (const std::size_t point = digits.find('.'); point != std::string::npos) {
    exponent -= std::ssize(digits) - static_cast<std::ptrdiff_t>(point) - 1;
    digits.erase(point, 1);
  }
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos)
    return std::nullopt;
  digits.erase(0, digits.find_first_not_of('0'));
  const std::ptrdiff_t whole = std::ssize(digits) + exponent;
  if (digits.empty() || whole < 0) return nanoseconds(0);
  if (whole > 19) return std::nullopt;
  const auto kept = static_cast<std::size_t>(whole);
  const bool up = kept < digits.size() && digits[kept] >= '5';
  digits.resize(kept, '0');
  const std::uint64_t count = number_of<std::uint64_t>("0" + digits).value() + (up ? 1 : 0);
  if (count > static_cast<std::uint64_t>(latest_time.count())) return std::nullopt;
  const nanoseconds time(static_cast<std::int64_t>(count));
  return negative ? -time : time;
}

std::string seconds_text(nanoseconds time) {
  const std::int64_t count = time.count();
  const std::uint64_t size =
      count < 0 ? -static_cast<std::uint64_t>(count) : static_cast<std::uint64_t>(count);
  return fmt::format("{}{}.{:09}", count < 0 ? "-" : "", size / 1'000'000'000,
                     size % 1'000'000'000);
}

/// @throws Error with the rule that the line breaks.
Trajectory::Sample parse_tum_line(const std::vector<std::string_view>& words) {
  constexpr std::array names{"t", "x", "y", "z", "qx", "qy", "qz", "qw"};
  if (words.size() != names.size()) {
    throw Error("it has {} values; it must have 8: t x y z qx qy qz qw", words.size());
  }
  const auto time = parse_seconds(words[0]);
  if (!time) {
    throw Error("t = {:?} must be a number of seconds, less than 4.6e9: is it in nanoseconds?",
                words[0].substr(0, 40));
  }
  std::array<double, names.size()> values{};
  for (std::size_t i = 1; i < names.size(); ++i) {
    const auto value = number_of<double>(words[i]);
    if (!value || !std::isfinite(*value)) {
      throw Error("{} = {:?} must be a finite number", names[i], words[i].substr(0, 40));
    }
    values[i] = *value;
  }
  const auto [t, x, y, z, qx, qy, qz, qw] = values;
  const glm::dquat rotation(qw, qx, qy, qz);
  const double norm = glm::length(rotation);
  if (!(std::abs(norm - 1) <= 1e-3)) {
    throw Error("the quaternion qx qy qz qw has norm {}; it must be 1: is qw the last of the four?",
                norm);
  }
  return {*time, {rotation / norm, {x, y, z}}};
}

}  // namespace

void write_whole(const std::filesystem::path& path,
                 const std::function<void(const std::filesystem::path&)>& write) {
  std::error_code ignored;
  const std::filesystem::file_status before = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(before) && !std::filesystem::is_regular_file(before)) {
    throw Error("{}: cannot be written: it is a folder or a device; choose another name",
                path.string());
  }
  std::filesystem::path aside = path;
  aside += ".part";
  try {
    write(aside);
    std::filesystem::rename(aside, path);
  } catch (const std::system_error& fault) {
    std::filesystem::remove(aside, ignored);
    throw Error("{}: cannot be written: {}; {}", path.string(), fault.code().message(),
                way_to_write(fault.code()));
  } catch (...) {
    std::filesystem::remove(aside, ignored);
    throw;
  }
}

void write_blocks(const std::filesystem::path& path,
                  const std::function<std::string_view()>& next_block) {
  write_whole(path, [&](const std::filesystem::path& aside) {
    File file(std::fopen(aside.c_str(), "wb"));
    if (!file) throw_system_error();
    std::setvbuf(file.get(), nullptr, _IONBF, 0);
    for (std::string_view block = next_block(); !block.empty(); block = next_block()) {
      if (std::fwrite(block.data(), 1, block.size(), file.get()) != block.size())
        throw_system_error();
    }
    if (std::fclose(file.release()) != 0) throw_system_error();
  });
}

void write_text(const std::filesystem::path& path, std::string_view text) {
  write_blocks(path, [&text] { return std::exchange(text, {}); });
}

std::string read_text(const std::filesystem::path& path) {
  const File file(std::fopen(path.c_str(), "rb"));
  std::string text;
  std::size_t size = 0;
  while (file && std::feof(file.get()) == 0 && std::ferror(file.get()) == 0) {
    text.resize(std::max<std::size_t>(2 * size, 1 << 16));
    size += std::fread(text.data() + size, 1, text.size() - size, file.get());
  }
  if (!file || std::ferror(file.get()) != 0) {
    throw Error("{}: cannot be read: {}; check its name and that you may read it", path.string(),
                std::generic_category().message(errno));
  }
  text.resize(size);
  return text;
}

void write_png(const std::filesystem::path& path, const Image8& image) {
  write_text(path, png_bytes(image, path.string()));
}

void write_png(const std::filesystem::path& path, const Image16& image) {
  write_text(path, png_bytes(image, path.string()));
}

Trajectory read_tum(const std::filesystem::path& path) {
  return parse_tum(read_text(path), path.string());
}

Trajectory parse_tum(std::string_view text, const std::string& name) {
  constexpr std::size_t most_faults = 100;
  std::vector<Trajectory::Sample> samples;
  std::string faults;
  std::size_t bad_lines = 0;
  TextLines lines(text);
  while (const auto line = lines.next()) {
    const std::vector<std::string_view> words = words_of(*line);
    if (words.empty() || words[0].starts_with('#')) continue;
    try {
      const Trajectory::Sample sample = parse_tum_line(words);
      if (!samples.empty() && sample.time <= samples.back().time) {
        throw Error("t = {} s does not lie after the {} s of a line above; times must increase",
                    seconds_text(sample.time), seconds_text(samples.back().time));
      }
      samples.push_back(sample);
    } catch (const Error& rule) {
      if (++bad_lines > most_faults) continue;
      faults +=
          fmt::format("{}{}:{}: {}", bad_lines == 1 ? "" : "\n", name, lines.number(), rule.what());
    }
  }
  if (bad_lines > most_faults) faults += fmt::format("\nand {} more", bad_lines - most_faults);
  if (bad_lines > 0) throw Error(faults);
  if (samples.empty()) throw Error("{}: it holds no pose; a line is t x y z qx qy qz qw", name);
  return Trajectory(std::move(samples));
}

void write_tum(const std::filesystem::path& path, const Trajectory& trajectory,
               std::string_view comment) {
  constexpr std::size_t block_bytes = 1 << 16;  // a path of days need not be in memory as text
  const auto& samples = trajectory.samples();
  std::size_t next = 0;
  std::string block;
  TextLines lines(comment);
  write_blocks(path, [&]() -> std::string_view {
    block.clear();
    while (const auto line = lines.next())
      fmt::format_to(std::back_inserter(block), "# {}\n", *line);
    for (; next < samples.size() && block.size() < block_bytes; ++next) {
      const auto& [time, pose] = samples[next];
      const auto& [q, p] = pose;
      fmt::format_to(std::back_inserter(block),
                     "{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n",
                     seconds_text(time), p.x, p.y, p.z, q.x, q.y, q.z, q.w);
    }
    return block;
  });
}

}  // namespace groundray
