#include "test/support/scans/stanford_bunny.h"

#include <filesystem>
#include <fstream>

#include "core/model/mesh_reader.h"
#include "test/support/gzip_file.h"
#include "test/support/temporary_folder.h"

namespace groundray::testing {

std::optional<TriangleMesh> stanford_bunny() {
  const auto packed = shared_data_folder() / "mesh/stanford_bunny_scans/bun_zipper.ply.gz";
  if (!std::filesystem::exists(packed)) return std::nullopt;
  const TemporaryFolder folder;
  std::ofstream(folder / "bunny.ply", std::ios::binary) << read_gzip(packed);
  return read_mesh(folder / "bunny.ply").mesh;
}

}  // namespace groundray::testing
