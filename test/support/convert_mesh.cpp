#include <fmt/format.h>

#include <exception>

#include "reconstruction/measured_mesh_io.h"

/// Writes a mesh of any form that is read, with what is known of its vertices, in another, and
/// prints what was left out.
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
