#include "reconstruction/mesh/mesh_arrays.h"

namespace groundray {

void check_columns(const MeasuredMesh& mesh, Violations& broken) {
  const std::size_t vertices = mesh.shape.vertices_m.size();
  const auto check = [&](const char* name, std::size_t count) {
    broken.unless(count == 0 || count == vertices,
                  "{} has {} values for {} vertices: it must have one per vertex or none", name,
                  count, vertices);
  };
  check("sd_m", mesh.sd_m.size());
  check("labels", mesh.labels.size());
  check("confidence", mesh.confidence.size());
}

}  // namespace groundray
