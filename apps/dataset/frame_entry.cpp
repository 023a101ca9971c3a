#include "apps/dataset/frame_entry.h"

#include <fmt/format.h>

#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <iterator>
#include <system_error>

namespace groundray {
namespace {

constexpr std::string_view letters_and_digits =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";

// Parses a line from left to right. After the first mismatch, every step fails.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : rest_(text) {}

  // Removes `word` from the start of the rest; returns false if it is not there.
  bool try_take(std::string_view word) {
    if (!fits_ || !rest_.starts_with(word)) return false;
    rest_.remove_prefix(word.size());
    return true;
  }
  void take(std::string_view word) { fits_ = try_take(word); }

  // Takes letters, digits and characters of `more`; requires at least one.
  std::string take_word(std::string_view more) {
    std::size_t size = 0;
    while (size < rest_.size() && (letters_and_digits.find(rest_[size]) != std::string_view::npos ||
                                   more.find(rest_[size]) != std::string_view::npos))
      ++size;
    return std::string(take_some(size));
  }

  // Takes the text before `end`; requires at least one character.
  std::string take_until(char end) {
    const std::size_t size = rest_.find(end);
    return std::string(take_some(size == std::string_view::npos ? 0 : size));
  }

  template <typename T>
  T take_number() {
    T number{};
    const auto [end, fault] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), number);
    // Accepts only the canonical spelling of a number.
    const auto size = static_cast<std::size_t>(end - rest_.data());
    fits_ = fits_ && fault == std::errc{} && fmt::format("{}", number) == rest_.substr(0, size);
    take_some(fits_ ? size : 0);
    return number;
  }

  FileSum take_sum() {
    constexpr std::size_t digits = 64;
    FileSum sum;
    take("bytes: ");
    sum.bytes = take_number<std::uint64_t>();
    take(", sha256: \"");
    sum.sha256 = take_word("");
    fits_ = fits_ && sum.sha256.size() == digits &&
            sum.sha256.find_first_not_of("0123456789abcdef") == std::string::npos;
    take("\"}");
    return sum;
  }

  void require(bool fits) { fits_ = fits_ && fits; }
  bool is_all_taken() const { return fits_ && rest_.empty(); }
  bool fits() const { return fits_; }

 private:
  std::string_view take_some(std::size_t size) {
    fits_ = fits_ && size > 0;
    if (!fits_) return {};
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }

  std::string_view rest_;
  bool fits_ = true;
};

std::chrono::nanoseconds take_stamp(Scanner& scanner) {
  constexpr std::size_t digits = 9;
  constexpr std::int64_t most_seconds = 9'000'000'000;  // range of nanoseconds
  const bool is_negative = scanner.try_take("-");
  const auto seconds = scanner.take_number<std::int64_t>();
  scanner.take(".");
  const std::string decimals = scanner.take_word("");
  std::int64_t rest = 0;
  const char* const end = decimals.data() + decimals.size();
  const auto [read, fault] = std::from_chars(decimals.data(), end, rest);
  scanner.require(read == end && fault == std::errc{} && decimals.size() == digits);
  scanner.require(seconds >= 0 && seconds < most_seconds);
  if (!scanner.fits()) return {};
  const std::int64_t count = seconds * 1'000'000'000 + rest;
  return std::chrono::nanoseconds(is_negative ? -count : count);
}

// Takes a mapping of plain values, if there is one at `key`.
std::string take_mapping(Scanner& scanner, std::string_view key) {
  if (!scanner.try_take(fmt::format(", {}: {{", key))) return {};
  const std::string values = scanner.take_until('}');
  scanner.take("}");
  return fmt::format("{{{}}}", values);
}

std::string sum_text(const FileSum& sum) {
  return fmt::format("bytes: {}, sha256: \"{}\"}}", sum.bytes, sum.sha256);
}

}  // namespace

std::string seconds_text(std::chrono::nanoseconds time) {
  const std::int64_t count = time.count();
  return fmt::format("{}{}.{:09}", count < 0 ? "-" : "", std::abs(count / 1'000'000'000),
                     std::abs(count % 1'000'000'000));
}

std::string text_of(const FrameEntry& entry) {
  std::string text =
      fmt::format("{{sensor: \"{}\", frame: {}, stamp_s: {}, state: {}", entry.sensor, entry.frame,
                  seconds_text(entry.stamp), entry.is_done ? "done" : "pending");
  if (!entry.convergence.empty()) text += ", convergence: " + entry.convergence;
  if (!entry.exposure.empty()) text += ", exposure: " + entry.exposure;
  for (const ProductSum& file : entry.files) {
    fmt::format_to(std::back_inserter(text), "{}\"{}\": {{{}",
                   &file == entry.files.data() ? ", files: {" : ", ", file.suffix,
                   sum_text(file.sum));
  }
  return text + (entry.files.empty() ? "}" : "}}");
}

std::optional<FrameEntry> parse_entry(std::string_view text) {
  Scanner scanner(text);
  FrameEntry entry;
  scanner.take("{sensor: \"");
  entry.sensor = scanner.take_word("_-");
  scanner.take("\", frame: ");
  entry.frame = scanner.take_number<std::int64_t>();
  scanner.require(entry.frame >= 0);
  scanner.take(", stamp_s: ");
  entry.stamp = take_stamp(scanner);
  scanner.take(", state: ");
  entry.is_done = scanner.try_take("done");
  if (!entry.is_done) scanner.take("pending");
  entry.convergence = take_mapping(scanner, "convergence");
  entry.exposure = take_mapping(scanner, "exposure");
  if (scanner.try_take(", files: {")) {
    do {
      scanner.take("\"");
      const std::string suffix = scanner.take_word("._-");
      scanner.take("\": {");
      entry.files.push_back({suffix, scanner.take_sum()});
    } while (scanner.try_take(", "));
    scanner.take("}");
    scanner.require(entry.is_done);
  }
  scanner.take("}");
  return scanner.is_all_taken() ? std::optional(std::move(entry)) : std::nullopt;
}

std::string text_of(const NamedSum& file) {
  return fmt::format("{{path: \"{}\", {}", file.path, sum_text(file.sum));
}

std::optional<NamedSum> parse_named_sum(std::string_view text) {
  Scanner scanner(text);
  NamedSum file;
  scanner.take("{path: \"");
  file.path = scanner.take_word("_-") + "/";  // only directly in a folder of the dataset
  scanner.take("/");
  const std::string name = scanner.take_word("._-");
  scanner.require(!name.starts_with('.'));
  file.path += name;
  scanner.take("\", ");
  file.sum = scanner.take_sum();
  return scanner.is_all_taken() ? std::optional(std::move(file)) : std::nullopt;
}

}  // namespace groundray
