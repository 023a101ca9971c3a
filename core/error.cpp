#include "core/error.h"

#include <fmt/ranges.h>

#include <string_view>

namespace groundray {

std::string Error::without_nul(std::string message) {
  constexpr std::string_view shown = "\\x00";
  for (auto at = message.find('\0'); at != std::string::npos; at = message.find('\0', at))
    message.replace(at, 1, shown);
  return message;
}

void Violations::throw_if_any() const {
  if (faults_.empty()) return;
  const std::string lead = faults_.size() == 1 ? " " : "\n  ";
  throw Error("{}:{}{}", subject_, lead, fmt::join(faults_, lead));
}

}  // namespace groundray
