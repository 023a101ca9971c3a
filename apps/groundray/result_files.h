#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

namespace groundray {

/// @throws Error unless the name ends in one of `endings`, whatever its case.
void check_ending(const std::filesystem::path& path, std::initializer_list<const char*> endings);

/// Checks, before work that may take long, that results can be written, each to a file of its own.
/// @param inputs  what will be read: none of these may be written over.
/// @throws Error naming the first fault.
void check_results(std::span<const std::filesystem::path> results,
                   std::span<const std::filesystem::path> inputs);

/// Files none of which appears before each is whole, and none unless all do. What has not appeared
/// is removed in the end.
class ResultFiles {
 public:
  ResultFiles() = default;
  ~ResultFiles();
  ResultFiles(const ResultFiles&) = delete;
  ResultFiles& operator=(const ResultFiles&) = delete;

  /// Has `write` fill the file under another name meanwhile: beside it, with the same ending, that
  /// no file had. @throws Error if it cannot be; and as `write`, with the file's own name.
  void write(const std::filesystem::path& path,
             const std::function<void(const std::filesystem::path&)>& write);

  /// Gives each file its name. If one cannot have it, the others are taken back: names have what
  /// they had before; but a file that was written over is lost where the disk knows no hard links.
  /// @throws Error naming the file that cannot get its name, and any that could not be taken back;
  ///         and under which name what they were is kept.
  void appear();

 private:
  struct File {
    std::filesystem::path path;
    std::filesystem::path aside;  // where it is meanwhile
    std::filesystem::path spare;  // another name of what had the path before; or none
    bool is_new = true;           // nothing had it
  };
  void spare(File& file) const;
  std::string take_back(std::size_t count);

  std::vector<File> files_;
};

}  // namespace groundray
