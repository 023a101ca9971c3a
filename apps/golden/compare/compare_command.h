#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>

#include "apps/golden/report.h"

namespace groundray::golden {

/// What is compared.
enum class Subject { Scan, Image, Dem, Mesh };

/// Returns what a file holds, by the end of its name and, for PLY, whether it has faces.
/// @throws Error if that does not tell, with the option that does.
Subject subject_of(const std::filesystem::path& file);

/// Returns what two files hold, each as above; what the other's name does not tell is the
/// reference's.
/// @throws Error also if they hold different things.
Subject subject_of(const std::filesystem::path& reference, const std::filesystem::path& other);

/// The command `compare`: holds one file against another and writes a report.
class CompareCommand {
 public:
  /// Adds the command to a program's.
  explicit CompareCommand(CLI::App& app);
  ~CompareCommand();

  bool is_asked_for() const { return command_->parsed(); }

  /// Writes report.html and report.json, and prints the figures.
  /// @return what was found: Failed if a limit is broken or they have nothing in common.
  /// @throws Error as compare_scans, compare_images, compare_dems and compare_meshes.
  Verdict run() const;

 private:
  struct Options;
  std::unique_ptr<Options> options_;
  CLI::App* command_;
};

}  // namespace groundray::golden
