#include <nanobind/nanobind.h>

#include "apps/python/binding/bind.h"

NB_MODULE(_core, module) {
  module.doc() = "Bindings of groundray's libraries. Import groundray instead.";
  module.attr("version") = GROUNDRAY_VERSION;
  groundray::python::bind_core(module);
  groundray::python::bind_mesh(module);
  groundray::python::bind_terrain(module);
  groundray::python::bind_image(module);
  groundray::python::bind_sensors(module);
  groundray::python::bind_scene(module);
  groundray::python::bind_worlds(module);
  groundray::python::bind_reconstruction(module);
  groundray::python::bind_dem(module);
  groundray::python::bind_golden(module);
}
