#include "apps/python/binding/pickle.h"

#include <fmt/format.h>
#include <nanobind/stl/array.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/io/print_error.h"

namespace groundray::python {
namespace {

constexpr int format = 1;  // number of the tuples' format

}  // namespace

PickledState::PickledState(const char* kind, nb::tuple values, std::size_t count)
    : kind_(kind), values_(std::move(values)) {
  int number = 0;
  if (values_.empty() || !nb::try_cast(values_[0], number, false) || number != format) {
    throw Error(
        "the pickled {} has another format than {}: it was written by another version of "
        "groundray; use the same for both",
        kind, format);
  }
  if (values_.size() != count + 1) {
    throw Error("the pickled {} is damaged: it has {} values, but must have {}", kind,
                values_.size(), count + 1);
  }
}

nb::handle PickledState::take() { return values_[++next_]; }

void PickledState::refuse(const std::string& name, const std::string& fault) const {
  throw Error("the pickled {} is damaged: its '{}' {}", kind_, printable(name), fault);
}

void add_georeference(const Georeference& georeference, nb::list& state) {
  const glm::dvec3 p = georeference.origin_w_m;
  state.append(nb::make_tuple(p.x, p.y, p.z));
  state.append(georeference.crs_name);
  state.append(georeference.crs_wkt);
}

Georeference read_georeference(PickledState& state) {
  const auto [x, y, z] = state.next<std::array<double, 3>>("origin_w_m");
  Georeference georeference{.origin_w_m = {x, y, z},
                            .crs_name = state.next<std::string>("crs_name"),
                            .crs_wkt = state.next<std::string>("crs_wkt")};
  if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
    state.refuse("origin_w_m", "is not finite");
  return georeference;
}

void refuse_subclass(nb::handle self, nb::handle type) {
  if (self.type().is(type)) return;
  const std::string name = nb::cast<std::string>(nb::inst_name(self));
  throw nb::type_error(
      fmt::format("a {} cannot be pickled: pickles hold objects of groundray's own classes; define "
                  "__reduce__ in the class that extends them",
                  name)
          .c_str());
}

nb::tuple reduced(const char* restorer, const nb::list& values) {
  nb::list state;
  state.append(format);
  state.extend(values);
  return nb::make_tuple(nb::module_::import_("groundray._pickle").attr(restorer),
                        nb::make_tuple(nb::tuple(state)));
}

}  // namespace groundray::python
