#pragma once

#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

/// NumPy arrays: views of memory that an owner keeps alive, never copies.
namespace groundray::python {

namespace nb = nanobind;

/// Read-only array of any type and shape.
using AnyArray = nb::ndarray<nb::numpy, nb::ro>;

using Shape = std::initializer_list<std::size_t>;

/// Returns a view of values that `owner` keeps alive.
/// @param step  distance between successive values of a one-dimensional array, in values.
template <typename T>
AnyArray view(const T* values, Shape shape, nb::handle owner, std::int64_t step = 1) {
  static const T none{};  // empty arrays need an address, too
  return {values != nullptr ? values : &none,  shape.size(),  shape.begin(), owner,
          shape.size() == 1 ? &step : nullptr, nb::dtype<T>()};
}

/// As view, for values that the array owns.
template <typename T>
AnyArray array_of(std::vector<T> values, Shape shape) {
  auto kept = std::make_unique<std::vector<T>>(std::move(values));
  nb::capsule owner(kept.get(), [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return view(kept.release()->data(), shape, owner);
}
template <typename T>
AnyArray array_of(std::vector<T> values) {
  const std::size_t count = values.size();
  return array_of(std::move(values), {count});
}

/// Returns a view of vectors as rows of three values.
template <typename T>
AnyArray view(const std::vector<glm::vec<3, T>>& rows, nb::handle owner) {
  static_assert(sizeof(glm::vec<3, T>) == 3 * sizeof(T));
  return view(rows.empty() ? nullptr : &rows.front().x, {rows.size(), 3}, owner);
}

}  // namespace groundray::python
