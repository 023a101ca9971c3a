#include "apps/golden/compare/compare_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "apps/golden/compare/dem_comparison.h"
#include "apps/golden/compare/image_comparison.h"
#include "apps/golden/compare/mesh_comparison.h"
#include "apps/golden/compare/scan_comparison.h"
#include "apps/scan/scan_flags.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

namespace fs = std::filesystem;

bool has_faces(const fs::path& ply) {
  std::ifstream file(ply, std::ios::binary);
  for (std::string line; std::getline(file, line) && !line.starts_with("end_header");) {
    if (line.starts_with("element face") && !line.starts_with("element face 0")) return true;
  }
  return false;
}

struct ImageFlags {
  PngMeaning png = PngMeaning::Picture;
  double depth_unit_m = 1;
  std::vector<std::string> channels;

  void add(CLI::App* group, const std::string& prefix) {
    const std::map<std::string, PngMeaning> meanings{
        {"picture", PngMeaning::Picture},
        {"kitti_depth", PngMeaning::KittiDepth},
        {"millimetre_depth", PngMeaning::MillimetreDepth},
        {"kitti_flow", PngMeaning::KittiFlow},
        {"label", PngMeaning::Label}};
    group->add_option("--" + prefix + "png", png, "What the numbers of a PNG are")
        ->transform(CLI::CheckedTransformer(meanings))
        ->option_text("picture|kitti_depth|millimetre_depth|kitti_flow|label");
    group->add_option("--" + prefix + "depth-unit-m", depth_unit_m, "Unit of depths, in metres")
        ->check(CLI::PositiveNumber);
    group
        ->add_option("--" + prefix + "channels", channels,
                     "THEIRS=OURS: what channels are, in the names of docs/formats.md")
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

void add_dem_flags(CLI::App* group, const std::string& prefix, DemOptions& options) {
  group->add_option("--" + prefix + "nodata", options.nodata, "A height that means 'none'");
  group->add_option("--" + prefix + "reproject-to", options.reproject_to,
                    "A CRS to warp to, such as EPSG:32631, or utm");
}

}  // namespace

namespace {

/// Nothing if the name does not tell.
std::optional<Subject> told_subject_of(const fs::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto is_one_of = [&](std::initializer_list<std::string_view> endings) {
    return std::ranges::find(endings, ending) != endings.end();
  };
  if (ending == ".ply") return has_faces(file) ? Subject::Mesh : Subject::Scan;
  if (is_one_of({".pcd", ".npy", ".npz", ".bin", ".las", ".laz", ".e57"})) return Subject::Scan;
  if (is_one_of({".exr", ".png", ".hdr", ".jpg", ".jpeg", ".flo", ".pfm"})) return Subject::Image;
  if (is_one_of({".obj", ".glb", ".gltf", ".stl"})) return Subject::Mesh;
  if (is_one_of({".tif", ".tiff", ".asc", ".hgt", ".vrt", ".img", ".nc", ".dem"}))
    return Subject::Dem;
  return std::nullopt;
}

std::string_view name_of(Subject subject) {
  static constexpr std::array<std::string_view, 4> names{"a scan", "an image", "a DEM", "a mesh"};
  return names[static_cast<std::size_t>(subject)];
}

}  // namespace

Subject subject_of(const fs::path& file) {
  if (const auto told = told_subject_of(file)) return *told;
  throw Error("{}: the name does not tell what it holds; say so by --as", file.string());
}

Subject subject_of(const fs::path& reference, const fs::path& other) {
  const Subject subject = subject_of(reference);
  const Subject of_other = told_subject_of(other).value_or(subject);
  if (of_other == subject) return subject;
  throw Error(
      "{} seems to be {} and {} {}: they must be of one kind; if both are, say which by --as",
      reference.string(), name_of(subject), other.string(), name_of(of_other));
}

struct CompareCommand::Options {
  fs::path reference, other;
  fs::path out = "out/compare";
  std::optional<Subject> subject;
  std::array<ScanFlags, 2> scan;  // of the other, of the reference
  std::array<ImageFlags, 2> image;
  DemReadings dem;
  MeshFineness mesh;
  PairingOptions pairing;
  std::optional<double> tolerance_mrad;
  ScanLimits limits;
  Significance significance;

  void add_scan(CLI::App* group) {
    const std::map<std::string, PairingRule> rules{{"best", PairingRule::Best},
                                                   {"pulse", PairingRule::Pulse},
                                                   {"ring_time", PairingRule::RingTime},
                                                   {"ring_azimuth", PairingRule::RingAzimuth},
                                                   {"direction", PairingRule::Direction}};
    group->add_option("--pair-by", pairing.rule, "How pulses are paired")
        ->transform(CLI::CheckedTransformer(rules))
        ->option_text("best|pulse|ring_time|ring_azimuth|direction");
    group->add_option("--pair-mrad", tolerance_mrad, "How far apart directions of a pair may be")
        ->check(CLI::PositiveNumber);
    group->add_option("--pair-s", pairing.tolerance_s, "How far apart times of a pair may be")
        ->check(CLI::PositiveNumber);
    group->add_option("--most-range-mean-m", limits.range_mean_m, "Fail beyond it");
    group->add_option("--most-range-rms-m", limits.range_rms_m, "Fail beyond it");
    group->add_option("--most-range-p99-m", limits.range_p99_m, "Fail beyond it");
    group->add_option("--most-missing", limits.missing_share, "Share; fail beyond it");
    group->add_option("--most-extra", limits.extra_share, "Share; fail beyond it");
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
          "compare", "Hold a scan, image, DEM or mesh, whoever made it, against a reference")) {
  Options& into = *options_;
  command_->add_option("REFERENCE", into.reference, "What is taken for true")->required();
  command_->add_option("OTHER", into.other, "What is judged")->required();
  const std::map<std::string, Subject> subjects{{"scan", Subject::Scan},
                                                {"image", Subject::Image},
                                                {"dem", Subject::Dem},
                                                {"mesh", Subject::Mesh}};
  command_->add_option("--as", into.subject, "What both are, if their names do not tell")
      ->transform(CLI::CheckedTransformer(subjects))
      ->option_text("scan|image|dem|mesh");
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
                   "Share of values of light that may fail their test")
      ->check(CLI::Range(0.0, 1.0));
  CLI::App* dems = command_->add_option_group("DEMs");
  add_dem_flags(dems, "", into.dem.other);
  add_dem_flags(dems, "reference-", into.dem.reference);
  CLI::App* meshes = command_->add_option_group("Meshes");
  meshes
      ->add_option("--tolerance-m", into.mesh.tolerance_m,
                   "Between the bounds of largest distances")
      ->check(CLI::PositiveNumber);
  meshes->add_option("--step-m", into.mesh.step_m, "Between samples of mean distances")
      ->check(CLI::PositiveNumber);
  meshes
      ->add_option("--within-m", into.mesh.within_m,
                   "Tell precision, completeness and F1 within so much; may be given again")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
}

CompareCommand::~CompareCommand() = default;

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
