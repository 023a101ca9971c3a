#include "test/support/temporary_folder.h"

#include <stdlib.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "core/own_folder.h"

namespace groundray::testing {

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "groundray-test-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make the folder " + name);
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path data_folder() { return source_folder() / "data"; }

std::filesystem::path shared_data_folder() {
  if (const char* chosen = std::getenv("GROUNDRAY_SHARED_DATA")) return chosen;
  return source_folder().parent_path() / "shared/data";
}

}  // namespace groundray::testing
