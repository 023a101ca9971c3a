#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <exception>
#include <filesystem>

#include "apps/python/binding/bind.h"
#include "apps/python/binding/long_call.h"
#include "apps/python/binding/pickle.h"
#include "apps/python/binding/points.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/ply_io.h"
#include "core/io/print_error.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;

bool has(const Points& points, const std::string& name) {
  const std::vector<std::string> names = names_of(points);
  return std::ranges::find(names, name) != names.end();
}

nb::list points_state(nb::handle self) {
  nb::list state;
  add_points(nb::cast<const Points&>(self), self, state);
  return state;
}

Points restored_points(const nb::tuple& values) {
  constexpr std::size_t count = 2;
  PickledState state("Points", values, count);
  return read_points(state);
}

void bind_points(nb::module_& module) {
  nb::class_<Points> type(module, "Points", R"(A table of points: columns of equal length.

points["range_true_m"] is a column as a NumPy array, a read-only view that keeps the table alive.
Names are those of the files (docs/reference/formats.md) with their units:
docs/guide/python.md lists them. dict(points) is a dict of all columns; len(points) counts rows.
points[points["label"] == 10] and points[::2] select rows: Points of their own.)");
  add_pickling(type, "points", &points_state);
  module.def("restore_points", &restored_points, "state"_a);
  type.def("__len__", [](const Points& points) { return points.cloud.rows(); })
      .def(
          "__getitem__",
          [](nb::handle_t<Points> self, const std::string& name) {
            return column_of(nb::cast<const Points&>(self), name, self);
          },
          "name"_a, "The column of this name, n values: a view.")
      .def("__getitem__", &selected, "rows"_a.none(),
           nb::sig("def __getitem__(self, rows: slice | collections.abc.Sequence[int] | "
                   "numpy.typing.NDArray[typing.Any], /) -> Points"),
           "The rows that a slice, a mask or indices select, in that order: a copy.")
      .def_prop_ro("xyz_m", &xyz_of, nb::rv_policy::automatic,
                   "The columns x_m, y_m, z_m as an array of n x 3, a copy: what Open3D, SciPy and "
                   "others take.")
      .def("__contains__", &has, "name"_a)
      .def(
          "__iter__", [](const Points& points) { return nb::iter(nb::cast(names_of(points))); },
          "Iterates over the names of the columns.")
      .def("keys", &names_of, "The names of the columns, as `columns`.")
      .def_prop_ro("columns", &names_of, "The names of the columns, in the order of the files.")
      .def(
          "save",
          [](const Points& points, const std::filesystem::path& path,
             const std::vector<std::string>& comments) {
            check_ending(path, {".ply"});
            without_gil([&](const StopRequest&) {
              write_ply(path, points.cloud, comments);
              return true;
            });
          },
          "path"_a, "comments"_a = std::vector<std::string>{},
          R"(Writes the table as a binary PLY file, columns by the names of docs/reference/formats.md.

The file appears only when it is complete. `comments` become lines of its header.)")
      .def("__repr__", [](const Points& points) {
        return fmt::format("<Points: {} rows of {}>", points.cloud.rows(),
                           fmt::join(names_of(points), ", "));
      });
  module.def(
      "load_points",
      [](const std::filesystem::path& path) {
        return Points{without_gil([&](const StopRequest&) { return read_ply(path).cloud; })};
      },
      "path"_a,
      R"(Reads the points of a PLY file, such as a scan that `groundray generate` wrote.

Columns listed in docs/reference/formats.md get names with units; others keep theirs.
Raises groundray.Error if the file cannot be read.)");
}

}  // namespace

void bind_core(nb::module_& module) {
  nb::exception<Error> error(module, "Error", PyExc_RuntimeError);
  error.doc() =
      "An invalid input or a failure: what is wrong, where, the rule and the likely fix, by line.";
  // Names from files must not control the terminal that shows a traceback.
  nb::register_exception_translator(
      [](const std::exception_ptr& thrown, void* type) {
        try {
          std::rethrow_exception(thrown);
        } catch (const Error& fault) {
          PyErr_SetString(static_cast<PyObject*>(type), printable(fault.what()).c_str());
        }
      },
      error.ptr());
  bind_points(module);
}

}  // namespace groundray::python
