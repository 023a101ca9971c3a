#pragma once

#include <nanobind/nanobind.h>

/// What the Python module is made of: a function for each library, which adds to the module what
/// that library has.
namespace groundray::python {

void bind_core(nanobind::module_& module);
void bind_mesh(nanobind::module_& module);
void bind_terrain(nanobind::module_& module);
void bind_sensors(nanobind::module_& module);
void bind_scene(nanobind::module_& module);
void bind_reconstruction(nanobind::module_& module);
void bind_dem(nanobind::module_& module);
void bind_golden(nanobind::module_& module);

}  // namespace groundray::python
