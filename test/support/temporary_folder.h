#pragma once

#include <filesystem>

namespace groundray::testing {

/// An empty folder that is removed with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::filesystem::path& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// The folder of the project's own data files.
std::filesystem::path data_folder();

/// The folder of large public data sets that some tests use: the environment's
/// GROUNDRAY_SHARED_DATA, or shared/data beside the repository. It need not exist.
std::filesystem::path shared_data_folder();

}  // namespace groundray::testing
