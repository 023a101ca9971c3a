#include <fmt/format.h>

#include <exception>

#include "reconstruction/mesh/measured_mesh_io.h"

/// Converts a mesh from any readable format to another, with the attributes of its vertices, and
/// prints the parts that were omitted.
///   convert_mesh IN OUT
int main(int argc, char** argv) {
  if (argc != 3) return 2;
  try {
    const auto file = groundray::read_measured_mesh(argv[1]);
    fmt::print("dropped {}\nskipped {}\n", file.dropped, file.skipped);
    groundray::write_measured_mesh(argv[2], file.mesh, file.georeference);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
