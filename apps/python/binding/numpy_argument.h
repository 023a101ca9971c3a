#pragma once

#include <fmt/format.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "core/error.h"

/// Numbers given by Python: arrays, or lists and other values that NumPy converts to arrays.
namespace groundray::python {

/// Array of the type and shape of `Array`, converted to these if necessary; integers are converted
/// only from integers. Call `check` before the values are read.
template <typename Array>
class NumpyArgument {
 public:
  NumpyArgument() = default;
  explicit NumpyArgument(Array array) : array_(std::move(array)) {}
  explicit NumpyArgument(std::exception_ptr fault) : fault_(std::move(fault)) {}
  explicit NumpyArgument(std::string misfit) : misfit_(std::move(misfit)) {}

  /// @param name  of the function and of its argument, for the message.
  /// @throws TypeError with the required and the given shape and type if the conversion failed; or
  ///         the error that Python raised meanwhile, e.g. for lack of memory.
  void check(std::string_view name) const {
    if (!misfit_.empty()) throw nanobind::type_error(fmt::format("{} {}", name, misfit_).c_str());
    if (fault_) std::rethrow_exception(fault_);
  }

  std::size_t rows() const { return array().shape(0); }
  std::size_t columns() const { return array().shape(1); }
  std::size_t size() const { return array().size(); }
  const auto* data() const { return array().data(); }
  /// Returns a value. Requires that one of the functions above has been called: they throw if the
  /// conversion failed.
  auto operator()(auto... place) const { return array_(place...); }

 private:
  const Array& array() const {
    check("an argument");
    return array_;
  }

  Array array_;
  std::exception_ptr fault_;
  std::string misfit_;  // required and given shape, if they do not match
};

template <typename T, typename Shape>
using GivenArray =
    NumpyArgument<nanobind::ndarray<const T, Shape, nanobind::c_contig, nanobind::device::cpu>>;
using GivenNumbers = GivenArray<double, nanobind::ndim<1>>;
using GivenPlaces = GivenArray<double, nanobind::shape<-1, 2>>;
using GivenPoints = GivenArray<double, nanobind::shape<-1, 3>>;
using GivenIndices = GivenArray<std::int64_t, nanobind::shape<-1, 3>>;
using GivenRaster = GivenArray<float, nanobind::ndim<2>>;

/// Returns a shape in words.
inline std::string words_of(nanobind::ndim<1> /*shape*/) { return "(n,)"; }
inline std::string words_of(nanobind::ndim<2> /*shape*/) { return "(rows, columns)"; }
template <nanobind::ssize_t columns>
std::string words_of(nanobind::shape<-1, columns> /*shape*/) {
  return fmt::format("(n, {})", columns);
}

/// Returns str(value) as printable UTF-8.
std::string text_of(nanobind::handle value);

/// Returns the shape and type of a NumPy array in words.
std::string form_of(nanobind::handle array);

/// Returns the largest of unsigned integers if a signed one of 64 bits cannot hold it; else an
/// empty text.
std::string excess_of(nanobind::handle array);

}  // namespace groundray::python

namespace nanobind::detail {

/// Accepts all values; those that neither the array's own caster nor numpy.asarray converts are
/// reported by NumpyArgument::check, which knows the argument's name. Masked values of a masked
/// array are holes (NaN) in rasters; elsewhere they are rejected.
template <typename Array>
struct type_caster<groundray::python::NumpyArgument<Array>> {
  using Argument = groundray::python::NumpyArgument<Array>;
  using ArrayCaster = make_caster<Array>;
  static constexpr bool is_whole = std::is_integral_v<std::remove_const_t<typename Array::Scalar>>;
  NB_TYPE_CASTER(Argument,
                 const_name<is_whole>("numpy.typing.NDArray[numpy.integer[typing.Any]] | "
                                      "collections.abc.Sequence[collections.abc.Sequence[int]]",
                                      "numpy.typing.ArrayLike"))

  bool from_python(handle source, std::uint8_t flags, cleanup_list* cleanup) noexcept {
    try {
      const object given = unlisted(source);
      if (!is_masked(given)) return read(source, flags, cleanup);
      const object any = module_::import_("numpy").attr("any")(given.attr("mask"));
      if (PyObject_IsTrue(any.ptr()) == 0) return read(given.attr("data"), flags, cleanup);
      if (is_raster) return read(holes_of(given), flags, cleanup);
      throw groundray::Error(
          "an array has masked values, which have no meaning here: remove them, or fill them by "
          "numpy.ma.filled");
    } catch (...) {
      value = Argument(std::current_exception());
      return true;
    }
  }

 private:
  static constexpr bool is_raster =
      std::is_same_v<std::remove_const_t<typename Array::Scalar>, float>;

  static bool is_masked(handle source) {
    return hasattr(source, "mask") && hasattr(source, "filled");
  }

  // Returns the array of a list of masked arrays; anything else as it is.
  static object unlisted(handle source) {
    if (isinstance<nanobind::list>(source) || isinstance<nanobind::tuple>(source)) {
      for (const handle each : source) {
        if (is_masked(each)) return module_::import_("numpy").attr("ma").attr("array")(source);
      }
    }
    return borrow(source);
  }

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
      const std::string over = is_whole ? groundray::python::excess_of(made) : "";
      if (!over.empty()) {
        value = Argument(misfit(fmt::format("an array with {}, which exceeds 2^63 - 1", over)));
      } else if ((is_whole && !holds_whole(made)) || !take(native(made), flags, cleanup)) {
        value = Argument(misfit(groundray::python::form_of(made)));
      }
    } catch (python_error& error) {
      if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
      std::string why;  // of its own, not of NumPy about values that are no numbers
      if (hasattr(source, "__array__")) why = groundray::python::text_of(error.value());
      if (!why.empty()) why.insert(0, ": ");
      const std::string type = cast<std::string>(source.type().attr("__name__"));
      value = Argument(misfit(fmt::format("a {}{}", type, why)));
    }
    return true;
  }

  bool take(handle source, std::uint8_t flags, cleanup_list* cleanup) noexcept {
    ArrayCaster caster;
    if (!caster.from_python(source, flags, cleanup)) return false;
    value = Argument(std::move(caster.value));
    return true;
  }

  // Returns an array of numbers in a form that the array's caster knows: in this machine's byte
  // order, and double instead of long double.
  static object native(const object& array) {
    const str kind(array.attr("dtype").attr("kind"));
    const bool is_wide = cast<int>(array.attr("dtype").attr("itemsize")) > 8;
    if (kind.equal(str("f")) && is_wide) return array.attr("astype")("float64");
    if (!kind.equal(str("f")) && !kind.equal(str("i")) && !kind.equal(str("u"))) return array;
    const object order = array.attr("dtype").attr("newbyteorder")("=");
    return array.attr("astype")(order, arg("copy") = false);
  }

  // Returns true for integers, but not for floats and bools. Empty arrays pass: their type has no
  // meaning.
  static bool holds_whole(const object& array) {
    const str kind(array.attr("dtype").attr("kind"));
    return kind.equal(str("i")) || kind.equal(str("u")) ||
           cast<std::size_t>(array.attr("size")) == 0;
  }

  static std::string misfit(std::string_view given) {
    return fmt::format("must be {} of shape {}, but is {}",
                       is_whole ? "integers" : "an array of numbers",
                       groundray::python::words_of(typename Array::Config::Shape{}), given);
  }
};

}  // namespace nanobind::detail
