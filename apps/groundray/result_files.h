#pragma once

#include <filesystem>
#include <span>
#include <utility>
#include <vector>

namespace groundray {

/// Checks, before work that may take long, that results can be written, each to a file of its own.
/// @param inputs  what will be read: none of these may be written over.
/// @throws Error naming the first fault.
void check_results(std::span<const std::filesystem::path> results,
                   std::span<const std::filesystem::path> inputs);

/// Files none of which appears before each is whole. What has not appeared is removed in the end.
class ResultFiles {
 public:
  ResultFiles() = default;
  ~ResultFiles();
  ResultFiles(const ResultFiles&) = delete;
  ResultFiles& operator=(const ResultFiles&) = delete;

  /// Returns where the file is to be written meanwhile: beside it, a name with the same ending that
  /// no file had. @throws Error if it cannot be.
  std::filesystem::path aside(const std::filesystem::path& path);

  /// @throws Error naming the file that cannot get its name.
  void appear();

 private:
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> files_;
};

}  // namespace groundray
