#pragma once

#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdint>
#include <utility>

/// Numbers that Python hands over: arrays, or lists and whatever else NumPy makes arrays of.
namespace groundray::python {

/// An array of the type and shape that `Array` says, converted to them where it was not.
template <typename Array>
class Given {
 public:
  Given() = default;
  explicit Given(Array array) : array_(std::move(array)) {}

  std::size_t rows() const { return array_.shape(0); }
  std::size_t columns() const { return array_.shape(1); }
  std::size_t size() const { return array_.size(); }
  auto operator()(auto... place) const { return array_(place...); }
  const auto* data() const { return array_.data(); }

 private:
  Array array_;
};

template <typename T, typename Shape>
using GivenArray =
    Given<nanobind::ndarray<const T, Shape, nanobind::c_contig, nanobind::device::cpu>>;
using GivenNumbers = GivenArray<double, nanobind::ndim<1>>;
using GivenPlaces = GivenArray<double, nanobind::shape<-1, 2>>;
using GivenPoints = GivenArray<double, nanobind::shape<-1, 3>>;
using GivenIndices = GivenArray<std::int64_t, nanobind::shape<-1, 3>>;
using GivenRaster = GivenArray<float, nanobind::ndim<2>>;

}  // namespace groundray::python

namespace nanobind::detail {

/// Takes what the array's own caster takes, and else what numpy.asarray makes of a value.
template <typename Array>
struct type_caster<groundray::python::Given<Array>> {
  using ArrayCaster = make_caster<Array>;
  NB_TYPE_CASTER(groundray::python::Given<Array>, const_name("numpy.typing.ArrayLike"))

  bool from_python(handle source, std::uint8_t flags, cleanup_list* cleanup) noexcept {
    ArrayCaster caster;
    if (caster.from_python(source, flags, cleanup)) {
      value = groundray::python::Given<Array>(std::move(caster.value));
      return true;
    }
    if ((flags & static_cast<std::uint8_t>(cast_flags::convert)) == 0) return false;
    try {
      const object made = module_::import_("numpy").attr("asarray")(source);
      if (!caster.from_python(made, flags, cleanup)) return false;
      value = groundray::python::Given<Array>(std::move(caster.value));
      return true;
    } catch (python_error&) {  // it is no array: the signature is told instead
      return false;
    }
  }
};

}  // namespace nanobind::detail
