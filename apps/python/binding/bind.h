#pragma once

#include <nanobind/nanobind.h>

/// Parts of the Python module: each function adds the bindings of one library or subject.
namespace groundray::python {

void bind_core(nanobind::module_& module);
void bind_mesh(nanobind::module_& module);
void bind_terrain(nanobind::module_& module);
void bind_image(nanobind::module_& module);
void bind_sensors(nanobind::module_& module);
void bind_scene(nanobind::module_& module);
void bind_worlds(nanobind::module_& module);
void bind_reconstruction(nanobind::module_& module);
void bind_dem(nanobind::module_& module);
void bind_golden(nanobind::module_& module);

}  // namespace groundray::python
