#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/golden/compare/dem_comparison.h"
#include "apps/golden/compare/images/image_comparison.h"
#include "apps/golden/compare/mesh_comparison.h"
#include "apps/golden/compare/scans/scan_comparison.h"
#include "apps/golden/compare/subject.h"
#include "apps/golden/report.h"
#include "apps/scan/scan_flags.h"

namespace groundray::golden {

/// Command-line options about the contents of an image.
struct ImageFlags {
  PngMeaning png = PngMeaning::Picture;
  double depth_unit_m = 1;
  std::vector<std::string> channels;

  /// Adds the options to a group, each name with `prefix` after the dashes.
  void add(CLI::App* group, const std::string& prefix);
  /// @throws Error if a channel is not given as THEIRS=OURS.
  ImageReading reading() const;
};

/// Command `compare`: compares a file with a reference and writes a report.
struct CompareCommand {
  std::filesystem::path reference, other;
  std::filesystem::path out = "out/compare";
  std::optional<Subject> subject;
  std::array<ScanFlags, 2> scan;  // [0] other, [1] reference; likewise below
  std::array<ImageFlags, 2> image;
  std::array<std::vector<double>, 2> origin_w_m;
  DemReadings dem;
  MeshFineness mesh;
  PairingOptions pairing;
  std::optional<double> tolerance_mrad;
  ScanLimits limits;
  Significance significance;
  std::vector<double> area, heights_m;
  std::vector<int> pixels;
  std::optional<double> ignore_beyond_m;

  void add_to(CLI::App* command);
  /// Compares the files, prints the figures, and writes report.html and report.json.
  Verdict run() const;

 private:
  void add_scans(CLI::App* group);
  void add_images(CLI::App* group);
  void add_dems(CLI::App* group);
  void add_meshes(CLI::App* group);
  void add_region(CLI::App* group);
  void check_options(Subject of) const;
  Scope scope() const;
  ScanReading scan_reading(std::size_t which) const;
  Section compare() const;
};

}  // namespace groundray::golden
