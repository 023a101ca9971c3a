#include "apps/golden/compare/scope.h"

#include <fmt/format.h>

#include <array>
#include <cstddef>

#include "core/error.h"

namespace groundray::golden {

void check_scope(const Scope& scope) {
  const glm::dvec3 &low = scope.low_m, &high = scope.high_m;
  if (!(low.x < high.x && low.y < high.y)) {
    throw Error(
        "the area {} {} {} {} must be W S E N, metres, with W < E and S < N: are they in another "
        "order?",
        low.x, low.y, high.x, high.y);
  }
  if (!(low.z < high.z)) {
    throw Error("the heights {} {} must be LOW HIGH, metres, with LOW < HIGH: are they swapped?",
                low.z, high.z);
  }
  if (!(scope.ignore_beyond_m > 0))
    throw Error("the distance beyond which points are ignored, {} m, must be positive",
                scope.ignore_beyond_m);
}

std::string scope_text(const Scope& scope, const std::string& frame) {
  std::string text, sides;
  constexpr std::array axes{"x", "y", "z"};
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    const double low_m = scope.low_m[axis], high_m = scope.high_m[axis];
    if (!std::isfinite(low_m) && !std::isfinite(high_m)) continue;
    const std::string limits = !std::isfinite(high_m) ? fmt::format("of at least {}", low_m)
                               : !std::isfinite(low_m)
                                   ? fmt::format("of at most {}", high_m)
                                   : fmt::format("from {} to {}", low_m, high_m);
    sides += fmt::format("{}{} {} m", sides.empty() ? "" : ", ",
                         axes[static_cast<std::size_t>(axis)], limits);
  }
  if (!sides.empty()) text += fmt::format("Only {} of {} is compared. ", sides, frame);
  if (scope.ignores()) {
    text += fmt::format(
        "What is farther than {} m from the other surface is left out; the figures state its "
        "share. ",
        scope.ignore_beyond_m);
  }
  return text;
}

void tell_ignored(Section& into, const std::string& whose, double part, double whole,
                  const std::string& unit, const Scope& scope) {
  if (!scope.ignores()) return;
  const std::string name = fmt::format("{}{}left out, farther than {} m from the other surface",
                                       whose, whose.empty() ? "" : ": ", scope.ignore_beyond_m);
  tell(into, name, part, unit);
  tell(into, name + ", share", whole > 0 ? 100 * part / whole : 0, "%");
}

}  // namespace groundray::golden
