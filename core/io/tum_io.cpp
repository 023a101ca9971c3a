#include "core/io/tum_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/text_lines.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

/// Half of the type's range, so that differences do not overflow.
constexpr nanoseconds latest_time = nanoseconds::max() / 2;

/// Parses a decimal number of seconds and rounds it to a nanosecond; a double would lose the last
/// two digits of 1600000000.123456789. Returns nothing if `word` is not a number or lies beyond
/// latest_time.
std::optional<nanoseconds> parse_seconds(std::string_view word) {
  const bool negative = word.starts_with('-');
  if (negative || word.starts_with('+')) word.remove_prefix(1);
  std::ptrdiff_t exponent = 9;  // the value is `digits` times ten to this power, ns
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

/// Parses the words of a line.
/// @throws Error with the violated rule.
Trajectory::Sample parse_tum_line(const std::vector<std::string_view>& words) {
  constexpr std::array names{"t", "x", "y", "z", "qx", "qy", "qz", "qw"};
  if (words.size() != names.size()) {
    const bool has_commas = words[0].find_first_of(",;") != std::string_view::npos;
    throw Error("the line has {} value{}; it must have 8: t x y z qx qy qz qw{}", words.size(),
                words.size() == 1 ? "" : "s",
                has_commas ? ", separated by spaces instead of commas" : "");
  }
  const auto time = parse_seconds(words[0]);
  if (!time) {
    if (std::ranges::any_of(words[0], [](unsigned char c) { return std::isalpha(c) != 0; }))
      throw Error("t = {:?} must be a number of seconds; a line of titles must begin with #",
                  words[0].substr(0, 40));
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
        throw Error("t = {} s is not later than the {} s of a line above; times must increase",
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
  if (samples.empty()) throw Error("{}: it contains no pose; a line is t x y z qx qy qz qw", name);
  return Trajectory(std::move(samples));
}

void write_tum(const std::filesystem::path& path, const Trajectory& trajectory,
               std::string_view comment) {
  constexpr std::size_t text_block_bytes = 1 << 16;  // of the text held in memory
  const auto& samples = trajectory.samples();
  std::size_t next = 0;
  std::string block;
  TextLines lines(comment);
  write_blocks(path, [&]() -> std::string_view {
    block.clear();
    while (const auto line = lines.next())
      fmt::format_to(std::back_inserter(block), "# {}\n", *line);
    for (; next < samples.size() && block.size() < text_block_bytes; ++next) {
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
