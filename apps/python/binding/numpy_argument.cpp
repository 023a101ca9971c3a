#include "apps/python/binding/numpy_argument.h"

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "core/io/print_error.h"

namespace groundray::python {

namespace nb = nanobind;

std::string text_of(nb::handle value) {
  const nb::object encoded = nb::str(value).attr("encode")("utf-8", "backslashreplace");
  const auto bytes = nb::cast<nb::bytes>(encoded);  // escapes for surrogates
  return printable({bytes.c_str(), bytes.size()});
}

std::string form_of(nb::handle array) {
  // Of objects: an accessor would be taken for a string, not converted to one.
  const nb::object shape = array.attr("shape"), type = array.attr("dtype");
  return fmt::format("shape {} and type {}", text_of(shape), text_of(type));
}

std::string excess_of(nb::handle array) {
  const nb::object kind = array.attr("dtype").attr("kind");
  if (text_of(kind) != "u" || nb::cast<std::size_t>(array.attr("size")) == 0) return {};
  const nb::object largest = array.attr("max")();
  const bool is_held = nb::cast<std::uint64_t>(largest.attr("item")()) <=
                       std::uint64_t{std::numeric_limits<std::int64_t>::max()};
  return is_held ? "" : text_of(largest);
}

}  // namespace groundray::python
