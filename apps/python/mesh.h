#pragma once

#include "core/mesh_io.h"
#include "reconstruction/measured_mesh.h"

namespace groundray::python {

/// A mesh in D, what is known of its vertices, and where D lies.
struct Mesh {
  MeasuredMesh measured;
  Georeference georeference{};
};

}  // namespace groundray::python
