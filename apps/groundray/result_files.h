#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace groundray {

/// Checks, before long computations, that the results can be written, each to its own file.
/// @param inputs  input files, which must not be overwritten; nor must any file of a dataset.
/// @throws Error naming the first fault.
void check_results(std::span<const std::filesystem::path> results,
                   std::span<const std::filesystem::path> inputs);

/// Group of files that appear together: none appears before all are complete. The destructor
/// removes those that have not appeared.
class ResultFiles {
 public:
  ResultFiles() = default;
  ~ResultFiles();
  ResultFiles(const ResultFiles&) = delete;
  ResultFiles& operator=(const ResultFiles&) = delete;

  /// Calls `write` to fill the file under a temporary name: in the same folder, with the same
  /// extension, unused before.
  /// @throws Error if that fails; and as `write`, with the file's own name in messages.
  void write(const std::filesystem::path& path,
             const std::function<void(const std::filesystem::path&)>& write);

  /// Renames the files to their paths, and prints that the last one is written. If one cannot be
  /// renamed, the others are undone: paths have their previous contents again. Without hard links
  /// in the file system, an overwritten file is lost. Call it last, because what fails afterwards
  /// leaves the files.
  /// @throws Error naming the file that cannot be renamed, and any that could not be undone, with
  ///         the names under which their previous contents are kept.
  void appear();

 private:
  struct File {
    std::filesystem::path path;
    std::filesystem::path aside;  // temporary name
    std::filesystem::path spare;  // second name of the file that was at the path; or empty
    bool is_new = true;           // true if no file was at the path
  };
  void spare(File& file) const;
  std::string take_back(std::size_t count);

  std::vector<File> files_;
};

}  // namespace groundray
