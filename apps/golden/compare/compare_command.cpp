#include "apps/golden/compare/compare_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "apps/golden/compare/dem_comparison.h"
#include "apps/golden/compare/images/image_comparison.h"
#include "apps/golden/compare/mesh_comparison.h"
#include "apps/golden/compare/scans/scan_comparison.h"
#include "apps/golden/compare/subject.h"
#include "apps/scan/scan_flags.h"
#include "apps/scan/word_option.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

namespace fs = std::filesystem;

void add_dem_flags(CLI::App* group, const std::string& prefix, DemOptions& options) {
  group->add_option("--" + prefix + "nodata", options.nodata,
                    "Height that marks missing samples (nodata)");
  group->add_option("--" + prefix + "reproject-to", options.reproject_to,
                    "CRS to reproject to, such as EPSG:32631, or utm");
}

}  // namespace

struct CompareCommand::Options {
  struct ImageFlags {
    PngMeaning png = PngMeaning::Picture;
    double depth_unit_m = 1;
    std::vector<std::string> channels;

    void add(CLI::App* group, const std::string& prefix) {
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
    ImageReading reading() const {
      ImageReading reading{.png = png, .depth_unit_m = depth_unit_m, .names = {}};
      for (const std::string& channel : channels) {
        const std::size_t equals = channel.find('=');
        if (equals == std::string::npos)
          throw Error("--channels: '{}' must be THEIRS=OURS, such as nn.X=N.X", channel);
        reading.names[channel.substr(0, equals)] = channel.substr(equals + 1);
      }
      return reading;
    }
  };

  fs::path reference, other;
  fs::path out = "out/compare";
  std::optional<Subject> subject;
  std::array<ScanFlags, 2> scan;  // [0] other, [1] reference; likewise below
  std::array<ImageFlags, 2> image;
  DemReadings dem;
  MeshFineness mesh;
  PairingOptions pairing;
  std::optional<double> tolerance_mrad;
  ScanLimits limits;
  Significance significance;

  void add_scan(CLI::App* group) {
    add_words(group, "--pair-by", pairing.rule, "Rule for pairing pulses",
              Words<PairingRule>{{"best", PairingRule::Best},
                                 {"pulse", PairingRule::Pulse},
                                 {"ring_time", PairingRule::RingTime},
                                 {"ring_azimuth", PairingRule::RingAzimuth},
                                 {"direction", PairingRule::Direction}});
    group
        ->add_option("--pair-mrad", tolerance_mrad,
                     "Largest angle between the directions of a pair")
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

  Section compare() const {
    switch (subject ? *subject : subject_of(reference, other)) {
      case Subject::Scan: {
        ScanOptions options{.reference = scan[1].reading(),
                            .other = scan[0].reading(),
                            .pairing = pairing,
                            .limits = limits};
        if (tolerance_mrad) options.pairing.tolerance_rad = *tolerance_mrad / 1000;
        return compare_scans(reference, other, options);
      }
      case Subject::Image:
        return compare_images(reference, other,
                              {.reference = image[1].reading(),
                               .other = image[0].reading(),
                               .significance = significance});
      case Subject::Dem:
        return compare_dems(reference, other, dem);
      case Subject::Mesh:
        break;
    }
    return compare_meshes(reference, other, mesh);
  }
};

CompareCommand::CompareCommand(CLI::App& app)
    : options_(std::make_unique<Options>()),
      command_(app.add_subcommand(
          "compare", "Compare a scan, image, DEM or mesh from any source with a reference")) {
  Options& into = *options_;
  command_->add_option("REFERENCE", into.reference, "File that is taken as the truth")->required();
  command_->add_option("OTHER", into.other, "File that is compared with it")->required();
  add_words(command_, "--as", into.subject, "Kind of both files, if their names do not show it",
            Words<Subject>{{"scan", Subject::Scan},
                           {"image", Subject::Image},
                           {"dem", Subject::Dem},
                           {"mesh", Subject::Mesh}});
  command_->add_option("-o,--output", into.out, "Folder for report.html and report.json")
      ->capture_default_str();
  CLI::App* scans = command_->add_option_group("Scans");
  into.scan[0].add(scans, "");
  into.scan[1].add(scans, "reference-");
  into.add_scan(scans);
  CLI::App* images = command_->add_option_group("Images");
  into.image[0].add(images, "");
  into.image[1].add(images, "reference-");
  images
      ->add_option("--share-beyond", into.significance.beyond_share,
                   "Fraction of radiance values that may fail their test")
      ->check(CLI::Range(0.0, 1.0));
  CLI::App* dems = command_->add_option_group("DEMs");
  add_dem_flags(dems, "", into.dem.other);
  add_dem_flags(dems, "reference-", into.dem.reference);
  CLI::App* meshes = command_->add_option_group("Meshes");
  meshes
      ->add_option("--tolerance-m", into.mesh.tolerance_m,
                   "Permitted gap between the bounds of the largest distance")
      ->check(CLI::PositiveNumber);
  meshes->add_option("--step-m", into.mesh.step_m, "Spacing of the samples for mean distances")
      ->check(CLI::PositiveNumber);
  meshes
      ->add_option("--within-m", into.mesh.within_m,
                   "Report precision, completeness and F1 within this distance; may be repeated")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
}

CompareCommand::~CompareCommand() = default;

bool CompareCommand::is_asked_for() const { return command_->parsed(); }

Verdict CompareCommand::run() const {
  const fs::path& out = options_->out;
  Report report{.title = "A comparison by groundray",
                .facts = {{"version", GROUNDRAY_VERSION},
                          {"reference", options_->reference.string()},
                          {"other", options_->other.string()}},
                .sections = {}};
  report.sections.push_back(options_->compare());
  const Section& section = report.sections.front();
  if (!section.text.empty()) fmt::print("{}\n", section.text);
  for (const Measure& measure : section.measures) {
    fmt::print("{}{}: {:.6g}{}{}{}\n", measure.verdict == Verdict::Failed ? "FAILED " : "",
               measure.name, measure.value, measure.unit.empty() ? "" : " ", measure.unit,
               measure.limit ? fmt::format(", at most {:.6g}", *measure.limit) : "");
  }
  fs::create_directories(out);
  write_html(out / "report.html", report);
  write_json(out / "report.json", report);
  fmt::print("see {}\n", (out / "report.html").string());
  return section.verdict;
}

}  // namespace groundray::golden
