#include <fmt/format.h>

#include <exception>
#include <string>
#include <vector>

#include "apps/scan/cloud_file.h"
#include "core/io/ply_io.h"

/// Writes the columns of a point file as a PLY, bit-identical except for names with blanks, and
/// prints the offsets that were subtracted from columns and the parts that were not read.
///   convert_cloud IN OUT.ply [COLUMN...]
int main(int argc, char** argv) {
  if (argc < 3) return 2;
  try {
    const std::vector<std::string> columns(argv + 3, argv + argc);
    const auto file = groundray::read_cloud(argv[1], columns);
    for (const auto& [column, origin] : file.origins) fmt::print("origin {} {}\n", column, origin);
    for (const std::string& unread : file.unread) fmt::print("unread {}\n", unread);
    groundray::write_ply(argv[2], file.cloud, {});
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
