#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/error.h"
#include "terrain/dem/band_file.h"
#include "terrain/dem/drape_io.h"

namespace {

// File of this process.
std::filesystem::path input_file() {
  std::string folder = std::filesystem::temp_directory_path() / "raster-fuzz-XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) std::abort();
  return std::filesystem::path(folder) / "fuzz.tif";
}

}  // namespace

/// For any bytes, the readers of rasters return samples or throw Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path path = input_file();
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    // Larger ones take longer than libFuzzer waits.
    const groundray::RasterKind kind = groundray::inspect_raster(path);
    if (1.0 * kind.samples.x * kind.samples.y * kind.bands > 1e6) return 0;
    groundray::read_bands(path, 4096);
    groundray::load_orthophoto(path, {});
  } catch (const groundray::Error&) {
  }
  return 0;
}
