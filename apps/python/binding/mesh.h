#pragma once

#include "core/io/mesh_io.h"
#include "reconstruction/mesh/measured_mesh.h"

namespace groundray::python {

/// Mesh in D with known properties of its vertices, and the position of D.
struct Mesh {
  MeasuredMesh measured;
  Georeference georeference{};
};

}  // namespace groundray::python
