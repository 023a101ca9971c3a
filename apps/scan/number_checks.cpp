#include "apps/scan/number_checks.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "core/io/text_lines.h"

namespace groundray {
namespace {

std::optional<double> number_in(const std::string& text) {
  double value = 0;
  if (!CLI::detail::lexical_cast(text, value) || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

CLI::Validator positive() {
  const auto check = [](const std::string& text) {
    const auto value = number_in(text);
    return value && *value > 0 ? std::string() : "'" + text + "' must be a number above 0";
  };
  return {check, "POSITIVE"};
}

CLI::Validator not_negative() {
  const auto check = [](const std::string& text) {
    const auto value = number_in(text);
    return value && *value >= 0 ? std::string() : "'" + text + "' must be a number, 0 or more";
  };
  return {check, "NONNEGATIVE"};
}

CLI::Validator whole() {
  const auto check = [](const std::string& text) {
    return number_of<std::uint64_t>(text)
               ? std::string()
               : "'" + text + "' must be a whole number from 0 to 2^64 - 1";
  };
  return {check, ""};
}

}  // namespace groundray
