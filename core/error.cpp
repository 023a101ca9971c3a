#include "core/error.h"

#include <fmt/ranges.h>

namespace groundray {

void Violations::throw_if_any() const {
  if (faults_.empty()) return;
  const std::string lead = faults_.size() == 1 ? " " : "\n  ";
  throw Error("{}:{}{}", subject_, lead, fmt::join(faults_, lead));
}

}  // namespace groundray
