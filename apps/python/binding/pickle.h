#pragma once

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/binding/arrays.h"
#include "core/error.h"
#include "core/io/mesh_io.h"

/// Pickles and copies of immutable objects.
namespace groundray::python {

/// Reads the values of a pickled object in the order in which they were written. Pickles come from
/// files and sockets, so nothing about them is taken for granted.
class PickledState {
 public:
  /// @param kind  name of the class, for messages.
  /// @throws Error unless `values` holds the number of this format and then `count` values.
  PickledState(const char* kind, nb::tuple values, std::size_t count);

  /// Returns the next value.
  /// @param name  for messages.
  /// @throws Error if it is not a T.
  template <typename T>
  T next(const char* name) {
    T value{};
    if (!nb::try_cast<T>(take(), value, false)) refuse(name, "is of another type");
    return value;
  }

  /// Returns the values of the next one, a contiguous array of this type and number of dimensions.
  /// @throws Error if it is anything else.
  template <typename T, std::size_t dimensions = 1>
  std::vector<T> next_array(const char* name) {
    using Array = nb::ndarray<const T, nb::ndim<dimensions>, nb::c_contig, nb::device::cpu>;
    const auto array = next<Array>(name);
    return std::vector<T>(array.data(), array.data() + array.size());
  }

  /// @throws Error that the value `name` of the pickled object breaks a rule.
  [[noreturn]] void refuse(const std::string& name, const std::string& fault) const;

 private:
  nb::handle take();

  const char* kind_;
  nb::tuple values_;
  std::size_t next_ = 0;
};

/// Adds the three values of a georeference to a state, and reads them.
void add_georeference(const Georeference& georeference, nb::list& state);
Georeference read_georeference(PickledState& state);

/// Returns what __reduce__ must: a function of groundray._pickle and its argument, a tuple of the
/// format's number and these values.
nb::tuple reduced(const char* restorer, const nb::list& values);

/// @throws nanobind::type_error if `self` is of a class of Python's that extends `type`: a pickle
///         would lose what that adds.
void refuse_subclass(nb::handle self, nb::handle type);

/// Adds __reduce__, __copy__ and __deepcopy__ to a class of immutable objects. Copies are the
/// object itself.
/// @param restorer  name of the function of groundray._pickle that makes the object again.
/// @param state_of  returns a list of the values that it needs; receives the object.
template <typename Type, typename StateOf>
void add_pickling(Type& type, const char* restorer, StateOf state_of) {
  const auto itself = [](nb::handle self) { return nb::borrow(self); };
  type.def("__reduce__",
           [=](nb::handle self) {
             refuse_subclass(self, nb::type<typename Type::Type>());
             return reduced(restorer, state_of(self));
           })
      .def("__copy__", itself, nb::sig("def __copy__(self) -> typing.Self"))
      .def(
          "__deepcopy__", [=](nb::handle self, nb::handle /*memo*/) { return itself(self); },
          nb::sig("def __deepcopy__(self, memo: object) -> typing.Self"));
}

}  // namespace groundray::python
