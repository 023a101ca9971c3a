#pragma once

#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <type_traits>
#include <utility>

#include "core/error.h"

/// Numbers given by Python: arrays, or lists and other values that NumPy converts to arrays.
namespace groundray::python {

/// Array of the type and shape of `Array`, converted to these if necessary; integers are converted
/// only from integers. If the conversion failed, e.g. for lack of memory, the first query throws
/// the error that Python raised.
template <typename Array>
class NumpyArgument {
 public:
  NumpyArgument() = default;
  explicit NumpyArgument(Array array) : array_(std::move(array)) {}
  explicit NumpyArgument(std::exception_ptr fault) : fault_(std::move(fault)) {}

  std::size_t rows() const { return array().shape(0); }
  std::size_t columns() const { return array().shape(1); }
  std::size_t size() const { return array().size(); }
  const auto* data() const { return array().data(); }
  /// Returns a value. Requires that one of the functions above has been called, which throws if the
  /// conversion failed.
  auto operator()(auto... place) const { return array_(place...); }

 private:
  const Array& array() const {
    if (fault_) std::rethrow_exception(fault_);
    return array_;
  }

  Array array_;
  std::exception_ptr fault_;
};

template <typename T, typename Shape>
using GivenArray =
    NumpyArgument<nanobind::ndarray<const T, Shape, nanobind::c_contig, nanobind::device::cpu>>;
using GivenNumbers = GivenArray<double, nanobind::ndim<1>>;
using GivenPlaces = GivenArray<double, nanobind::shape<-1, 2>>;
using GivenPoints = GivenArray<double, nanobind::shape<-1, 3>>;
using GivenIndices = GivenArray<std::int64_t, nanobind::shape<-1, 3>>;
using GivenRaster = GivenArray<float, nanobind::ndim<2>>;

}  // namespace groundray::python

namespace nanobind::detail {

/// Accepts all values that the array's own caster accepts, and otherwise converts by numpy.asarray.
/// Masked values of a masked array are holes (NaN) in rasters; elsewhere they are rejected.
template <typename Array>
struct type_caster<groundray::python::NumpyArgument<Array>> {
  using ArrayCaster = make_caster<Array>;
  static constexpr bool is_whole = std::is_integral_v<std::remove_const_t<typename Array::Scalar>>;
  NB_TYPE_CASTER(groundray::python::NumpyArgument<Array>,
                 const_name<is_whole>("numpy.typing.NDArray[numpy.integer[typing.Any]] | "
                                      "collections.abc.Sequence[collections.abc.Sequence[int]]",
                                      "numpy.typing.ArrayLike"))

  bool from_python(handle source, std::uint8_t flags, cleanup_list* cleanup) noexcept {
    try {
      if (!hasattr(source, "mask") || !hasattr(source, "filled"))
        return read(source, flags, cleanup);
      const object given = borrow(source);
      const object any = module_::import_("numpy").attr("any")(given.attr("mask"));
      if (PyObject_IsTrue(any.ptr()) == 0) return read(given.attr("data"), flags, cleanup);
      if (is_raster) return read(holes_of(given), flags, cleanup);
      throw groundray::Error(
          "an array has masked values, which have no meaning here: remove them, or fill them by "
          "numpy.ma.filled");
    } catch (...) {
      value = groundray::python::NumpyArgument<Array>(std::current_exception());
      return true;
    }
  }

 private:
  static constexpr bool is_raster =
      std::is_same_v<std::remove_const_t<typename Array::Scalar>, float>;

  static object holes_of(const object& masked) {
    const object numpy = module_::import_("numpy");
    return masked.attr("astype")(numpy.attr("float32")).attr("filled")(numpy.attr("nan"));
  }

  bool read(handle source, std::uint8_t flags, cleanup_list* cleanup) {
    constexpr auto convert = static_cast<std::uint8_t>(cast_flags::convert);
    const auto as_it_is = static_cast<std::uint8_t>(flags & ~convert);
    if (take(source, is_whole ? as_it_is : flags, cleanup)) return true;
    if ((flags & convert) == 0) return false;
    try {
      const object made = module_::import_("numpy").attr("asarray")(source);
      return (!is_whole || holds_whole(made)) && take(made, flags, cleanup);
    } catch (python_error& error) {
      // Not an array: nanobind reports the signature instead.
      if (error.matches(PyExc_TypeError) || error.matches(PyExc_ValueError)) return false;
      throw;
    }
  }

  bool take(handle source, std::uint8_t flags, cleanup_list* cleanup) noexcept {
    ArrayCaster caster;
    if (!caster.from_python(source, flags, cleanup)) return false;
    value = groundray::python::NumpyArgument<Array>(std::move(caster.value));
    return true;
  }

  // Returns true for integers, but not for floats and bools. Empty arrays pass: their type has no
  // meaning.
  static bool holds_whole(const object& array) {
    const str kind(array.attr("dtype").attr("kind"));
    return kind.equal(str("i")) || kind.equal(str("u")) ||
           cast<std::size_t>(array.attr("size")) == 0;
  }
};

}  // namespace nanobind::detail
