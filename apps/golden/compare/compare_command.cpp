#include "apps/golden/compare/compare_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "apps/golden/conform/conform_commands.h"
#include "apps/scan/number_checks.h"
#include "apps/scan/word_option.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

void add_dem_flags(CLI::App* group, const std::string& prefix, DemOptions& options) {
  group->add_option("--" + prefix + "nodata", options.nodata,
                    "Height that marks missing samples (nodata)");
  group->add_option("--" + prefix + "reproject-to", options.reproject_to,
                    "CRS to reproject to, such as EPSG:32631, or utm");
}

std::optional<glm::dvec3> vector_of(const std::vector<double>& numbers) {
  if (numbers.empty()) return std::nullopt;
  return glm::dvec3(numbers[0], numbers[1], numbers[2]);
}

}  // namespace

void ImageFlags::add(CLI::App* group, const std::string& prefix) {
  add_words(group, "--" + prefix + "png", png, "Meaning of a PNG's values",
            Words<PngMeaning>{{"picture", PngMeaning::Picture},
                              {"kitti_depth", PngMeaning::KittiDepth},
                              {"millimetre_depth", PngMeaning::MillimetreDepth},
                              {"kitti_flow", PngMeaning::KittiFlow},
                              {"label", PngMeaning::Label}});
  group->add_option("--" + prefix + "depth-unit-m", depth_unit_m, "Unit of depths, in metres")
      ->check(CLI::PositiveNumber);
  group
      ->add_option("--" + prefix + "channels", channels,
                   "THEIRS=OURS: maps channel names to those of docs/reference/formats.md")
      ->delimiter(',');
}

ImageReading ImageFlags::reading() const {
  ImageReading reading{.png = png, .depth_unit_m = depth_unit_m, .names = {}};
  for (const std::string& channel : channels) {
    const std::size_t equals = channel.find('=');
    if (equals == std::string::npos)
      throw Error("--channels: '{}' must be THEIRS=OURS, such as nn.X=N.X", channel);
    reading.names[channel.substr(0, equals)] = channel.substr(equals + 1);
  }
  return reading;
}

void CompareCommand::add_scans(CLI::App* group) {
  scan[0].add(group, "");
  scan[1].add(group, "reference-");
  add_words(group, "--pair-by", pairing.rule, "Rule for pairing pulses",
            Words<PairingRule>{{"best", PairingRule::Best},
                               {"pulse", PairingRule::Pulse},
                               {"ring_time", PairingRule::RingTime},
                               {"ring_azimuth", PairingRule::RingAzimuth},
                               {"direction", PairingRule::Direction}});
  group->add_option("--pair-mrad", tolerance_mrad, "Largest angle between the directions of a pair")
      ->check(CLI::PositiveNumber);
  group
      ->add_option("--pair-s", pairing.tolerance_s,
                   "Largest difference between the times of a pair")
      ->check(CLI::PositiveNumber);
  group->add_option("--most-range-mean-m", limits.range_mean_m,
                    "Fail if the magnitude of the mean range error is larger");
  group->add_option("--most-range-rms-m", limits.range_rms_m,
                    "Fail if the RMS range error is larger");
  group->add_option("--most-range-p99-m", limits.range_p99_m,
                    "Fail if the 99th percentile of range errors is larger");
  group->add_option("--most-missing", limits.missing_share,
                    "Fail if a larger fraction of returns is missing");
  group->add_option("--most-extra", limits.extra_share,
                    "Fail if a larger fraction of returns is extra");
}

void CompareCommand::add_images(CLI::App* group) {
  image[0].add(group, "");
  image[1].add(group, "reference-");
  group
      ->add_option("--share-beyond", significance.beyond_share,
                   "Fraction of radiance values that may fail their test")
      ->check(CLI::Range(0.0, 1.0));
}

void CompareCommand::add_dems(CLI::App* group) {
  add_dem_flags(group, "", dem.other);
  add_dem_flags(group, "reference-", dem.reference);
}

void CompareCommand::add_meshes(CLI::App* group) {
  group
      ->add_option("--tolerance-m", mesh.tolerance_m,
                   "Permitted gap between the bounds of the largest distance")
      ->check(CLI::PositiveNumber);
  group->add_option("--step-m", mesh.step_m, "Spacing of the samples for mean distances")
      ->check(CLI::PositiveNumber);
  group
      ->add_option("--within-m", mesh.within_m,
                   "Report precision, completeness and F1 within this distance; may be repeated")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
}

void CompareCommand::add_region(CLI::App* group) {
  group
      ->add_option("--area", area,
                   "W S E N in world coordinates, metres: compare only what is within these limits "
                   "of scans, DEMs or meshes")
      ->delimiter(',')
      ->expected(4);
  group
      ->add_option("--heights-m", heights_m,
                   "LOW HIGH in world coordinates, metres: compare only what is between them")
      ->delimiter(',')
      ->expected(2);
  group
      ->add_option("--ignore-beyond-m", ignore_beyond_m,
                   "Leave out what is farther than this from the other scan, DEM or mesh, and "
                   "report its share")
      ->check(positive());
  group
      ->add_option("--pixels", pixels,
                   "COLUMN ROW WIDTH HEIGHT: compare only these pixels of images")
      ->delimiter(',')
      ->expected(4);
  for (const std::size_t which : {0U, 1U}) {
    group
        ->add_option(which == 0 ? "--origin" : "--reference-origin", origin_w_m[which],
                     "x,y,z in world coordinates, metres, of the origin of a mesh or scan whose "
                     "file does not state it")
        ->delimiter(',')
        ->expected(3);
  }
}

void CompareCommand::add_to(CLI::App* command) {
  command->add_option("REFERENCE", reference, "File that is taken as the truth")->required();
  command->add_option("OTHER", other, "File that is compared with it")->required();
  add_words(command, "--as", subject, "Kind of both files, if their names do not show it",
            Words<Subject>{{"scan", Subject::Scan},
                           {"image", Subject::Image},
                           {"dem", Subject::Dem},
                           {"mesh", Subject::Mesh}});
  command->add_option("-o,--output", out, "Folder for report.html and report.json")
      ->capture_default_str();
  add_region(command->add_option_group("Region and place"));
  add_scans(command->add_option_group("Scans"));
  add_images(command->add_option_group("Images"));
  add_dems(command->add_option_group("DEMs"));
  add_meshes(command->add_option_group("Meshes"));
}

/// @throws Error naming an option of a region or place that the kind of files does not have.
void CompareCommand::check_options(Subject of) const {
  const auto refuse = [](std::string_view option, std::string_view kinds) {
    throw Error("{} is for {}: omit it, or give the kind of the files with --as", option, kinds);
  };
  constexpr std::string_view surfaces = "scans, DEMs and meshes";
  const bool is_image = of == Subject::Image,
             is_placed = of == Subject::Scan || of == Subject::Mesh;
  if (!area.empty() && is_image) refuse("--area", surfaces);
  if (!heights_m.empty() && is_image) refuse("--heights-m", surfaces);
  if (ignore_beyond_m && is_image) refuse("--ignore-beyond-m", surfaces);
  if (!pixels.empty() && !is_image) refuse("--pixels", "images");
  if (!origin_w_m[0].empty() && !is_placed) refuse("--origin", "scans and meshes");
  if (!origin_w_m[1].empty() && !is_placed) refuse("--reference-origin", "scans and meshes");
  if (of == Subject::Scan && !origin_w_m[0].empty() && !scan[0].has_pose()) {
    throw Error(
        "--origin: a scan without --sensor-pose is placed by the pose of the reference, so its "
        "origin has no effect: give both or neither");
  }
  for (const std::vector<double>& origin : origin_w_m) {
    if (!std::ranges::all_of(origin, [](double x) { return std::isfinite(x); }))
      throw Error("--origin, --reference-origin: all numbers must be finite");
  }
}

Scope CompareCommand::scope() const {
  Scope result;
  if (!area.empty()) {
    result.low_m = {area[0], area[1], result.low_m.z};
    result.high_m = {area[2], area[3], result.high_m.z};
  }
  if (!heights_m.empty()) {
    result.low_m.z = heights_m[0];
    result.high_m.z = heights_m[1];
  }
  result.ignore_beyond_m = ignore_beyond_m.value_or(result.ignore_beyond_m);
  return result;
}

ScanReading CompareCommand::scan_reading(std::size_t which) const {
  ScanReading reading = scan[which].reading();
  reading.origin_w_m = vector_of(origin_w_m[which]).value_or(glm::dvec3(0));
  // With an origin, the pose is in W; a viewpoint is always in the frame of its file.
  if (scan[which].has_pose()) std::get<Pose>(reading.X_FS).translation_m -= reading.origin_w_m;
  return reading;
}

Section CompareCommand::compare() const {
  const Subject of = subject ? *subject : subject_of(reference, other);
  check_options(of);
  switch (of) {
    case Subject::Scan: {
      ScanOptions options{.reference = scan_reading(1),
                          .other = scan_reading(0),
                          .pairing = pairing,
                          .limits = limits,
                          .scope = scope()};
      if (tolerance_mrad) options.pairing.tolerance_rad = *tolerance_mrad / 1000;
      return compare_scans(reference, other, options);
    }
    case Subject::Image: {
      ImageOptions options{.reference = image[1].reading(),
                           .other = image[0].reading(),
                           .significance = significance};
      if (!pixels.empty())
        options.pixels = PixelBox{{pixels[0], pixels[1]}, {pixels[2], pixels[3]}};
      return compare_images(reference, other, options);
    }
    case Subject::Dem:
      return compare_dems(reference, other, dem, scope());
    case Subject::Mesh:
      break;
  }
  return compare_meshes(reference, other, mesh, scope(),
                        {vector_of(origin_w_m[1]), vector_of(origin_w_m[0])});
}

Verdict CompareCommand::run() const {
  check_report_folder(out);
  Report report{.title = "A comparison by groundray",
                .facts = {{"version", GROUNDRAY_VERSION},
                          {"reference", reference.string()},
                          {"other", other.string()}},
                .sections = {}};
  report.sections.push_back(compare());
  publish(report, out);
  return report.sections.front().verdict;
}

}  // namespace groundray::golden
