#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/model/polygon_soup.h"
#include "test/fuzz/model_check.h"

namespace {

// Name of a model that does not exist, in a folder of this process that has a buffer and a file
// outside it.
std::filesystem::path model_name() {
  std::string folder = std::filesystem::temp_directory_path() / "gltf-fuzz-XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) std::abort();
  const std::filesystem::path within = std::filesystem::path(folder) / "model";
  std::filesystem::create_directory(within);
  for (const auto& place : {within / "wedge.bin", within / "../outside.bin"})
    std::ofstream(place, std::ios::binary) << std::string(96, '\1');
  return within / "fuzz.glb";
}

}  // namespace

/// For any bytes, read_gltf returns a model whose indices are valid, or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path path = model_name();
  try {
    check_model(groundray::read_gltf(path, {reinterpret_cast<const char*>(data), size}));
  } catch (const groundray::Error&) {
  }
  return 0;
}
