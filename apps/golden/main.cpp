#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "apps/golden/compare/dem_comparison.h"
#include "apps/golden/compare/images/image_comparison.h"
#include "apps/golden/compare/mesh_comparison.h"
#include "apps/golden/compare/scans/scan_comparison.h"
#include "apps/golden/compare/subject.h"
#include "apps/golden/conform/conform_commands.h"
#include "apps/golden/report.h"
#include "apps/golden/suite/checks.h"
#include "apps/golden/suite/golden_case.h"
#include "apps/golden/suite/suite.h"
#include "apps/scan/scan_flags.h"
#include "apps/scan/usage_fault.h"
#include "apps/scan/word_option.h"
#include "apps/scene/interruption.h"
#include "apps/scene/simulation.h"
#include "core/error.h"
#include "core/io/print_error.h"
#include "core/near_names.h"

namespace groundray::golden {
namespace {

namespace fs = std::filesystem;

constexpr int done = 0;
constexpr int failed = 1;
constexpr int interrupted = 130;

void add_dem_flags(CLI::App* group, const std::string& prefix, DemOptions& options) {
  group->add_option("--" + prefix + "nodata", options.nodata,
                    "Height that marks missing samples (nodata)");
  group->add_option("--" + prefix + "reproject-to", options.reproject_to,
                    "CRS to reproject to, such as EPSG:32631, or utm");
}

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

/// Command `compare`: compares a file with a reference and writes a report.
struct CompareCommand {
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

  void add_to(CLI::App* command) {
    command->add_option("REFERENCE", reference, "File that is taken as the truth")->required();
    command->add_option("OTHER", other, "File that is compared with it")->required();
    add_words(command, "--as", subject, "Kind of both files, if their names do not show it",
              Words<Subject>{{"scan", Subject::Scan},
                             {"image", Subject::Image},
                             {"dem", Subject::Dem},
                             {"mesh", Subject::Mesh}});
    command->add_option("-o,--output", out, "Folder for report.html and report.json")
        ->capture_default_str();
    CLI::App* scans = command->add_option_group("Scans");
    scan[0].add(scans, "");
    scan[1].add(scans, "reference-");
    add_scan(scans);
    CLI::App* images = command->add_option_group("Images");
    image[0].add(images, "");
    image[1].add(images, "reference-");
    images
        ->add_option("--share-beyond", significance.beyond_share,
                     "Fraction of radiance values that may fail their test")
        ->check(CLI::Range(0.0, 1.0));
    CLI::App* dems = command->add_option_group("DEMs");
    add_dem_flags(dems, "", dem.other);
    add_dem_flags(dems, "reference-", dem.reference);
    CLI::App* meshes = command->add_option_group("Meshes");
    meshes
        ->add_option("--tolerance-m", mesh.tolerance_m,
                     "Permitted gap between the bounds of the largest distance")
        ->check(CLI::PositiveNumber);
    meshes->add_option("--step-m", mesh.step_m, "Spacing of the samples for mean distances")
        ->check(CLI::PositiveNumber);
    meshes
        ->add_option("--within-m", mesh.within_m,
                     "Report precision, completeness and F1 within this distance; may be repeated")
        ->delimiter(',')
        ->check(CLI::PositiveNumber);
  }

  /// Compares the files, prints the figures, and writes report.html and report.json.
  Verdict run() const {
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
};

fs::path own_folder() {
  std::error_code ignored;
  return fs::read_symlink("/proc/self/exe", ignored).parent_path();
}

void print(const Section& section) {
  print_text(stdout, "{} {}\n", section.verdict == Verdict::Passed ? "passed" : "FAILED",
             section.title);
  for (const Measure& measure : section.measures) {
    if (measure.verdict != Verdict::Failed) continue;
    print_text(stdout, "       {}: {:.6g} {}, but at most {:.6g} because: {}\n", measure.name,
               measure.value, measure.unit, measure.limit.value_or(0), measure.because);
  }
}

int run_suite(const fs::path& folder, const std::vector<std::string>& filters,
              const SuiteOptions& options) {
  check_report_folder(options.out);
  for (const char* name : {"report.html", "report.json", "junit.xml"})
    fs::remove(options.out / name);  // left by an earlier run
  Report report = run_cases(read_cases(folder, filters), options);
  report.facts = {{"version", GROUNDRAY_VERSION},
                  {"program", options.program.string()},
                  {"made with", made_with()},
                  {"cases", folder.string()}};
  std::ranges::for_each(report.sections, print);
  write_html(options.out / "report.html", report);
  write_json(options.out / "report.json", report);
  write_junit(options.out / "junit.xml", report);
  const auto good = std::ranges::count(report.sections, Verdict::Passed, &Section::verdict);
  print_text(stdout, "{} of {} cases passed; see {}\n", good, report.sections.size(),
             (options.out / "report.html").string());
  return good == std::ssize(report.sections) ? done : failed;
}

int accept(const fs::path& folder, const std::vector<std::string>& names,
           const SuiteOptions& options) {
  for (const std::string& name : names) {
    const fs::path place = (folder / name / "").parent_path();  // drops a trailing slash
    if (!fs::is_directory(place)) throw Error("{}: {}", place.string(), why_no_file(place));
    accept_case(read_case(place), options);
    print_text(stdout, "stored: {}\n", (place / "expected").string());
  }
  return done;
}

int run(int argc, char** argv) {
  CLI::App app(
      "groundray-golden checks groundray's results for small scenes against closed forms, golden "
      "files and statistics, and compares scans, images, DEMs and meshes from any source.",
      "groundray-golden");
  app.footer(
      "A first run:  groundray-golden run\n"
      "Exit codes:   0 all passed, 1 failed, 2 wrong usage, 130 interrupted");
  app.set_version_flag("--version", "groundray-golden " GROUNDRAY_VERSION);
  app.require_subcommand(1);

  fs::path folder = source_folder() / "test/golden";
  SuiteOptions options{.program = own_folder() / "groundray",
                       .out = "out/golden",
                       .jobs = std::max(1U, std::thread::hardware_concurrency())};
  const auto add_options = [&](CLI::App* command) {
    command->add_option("--cases", folder, "Folder of cases; groundray's own by default");
    command->add_option("--program", options.program, "The `groundray` executable to test");
    command->add_option("-o,--output", options.out, "Folder for datasets and reports")
        ->capture_default_str();
    command->add_option("-j,--jobs", options.jobs, "Number of cases that run in parallel")
        ->check(CLI::Range(1U, 1024U));
  };
  std::vector<std::string> filters;
  auto* run_command =
      app.add_subcommand("run", "Run the cases; write report.html, report.json and junit.xml");
  add_options(run_command);
  run_command->add_option("--filter", filters, "Only cases whose names contain one of these");
  std::vector<std::string> names;
  auto* accept_command = app.add_subcommand(
      "accept", "Store new golden files of cases; give the reason in the commit message");
  add_options(accept_command);
  accept_command->add_option("CASE", names, "Names of cases")->required();

  CompareCommand compare;
  auto* compare_command = app.add_subcommand(
      "compare", "Compare a scan, image, DEM or mesh from any source with a reference");
  compare.add_to(compare_command);

  PassesCommand passes;
  auto* passes_command = app.add_subcommand(
      "passes", "Write what each pass of the mesher and each ray yields for a DEM, as NPY");
  passes.add_to(passes_command);
  ConformCommand conform;
  auto* conform_command = app.add_subcommand(
      "conform", "Judge another mesher or tracer, such as a GPU's, by the arrays of `passes`");
  conform.add_to(conform_command);

  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  if (compare_command->parsed()) return compare.run() == Verdict::Failed ? failed : done;
  if (conform_command->parsed()) return conform.run() == Verdict::Failed ? failed : done;
  if (passes_command->parsed()) {
    passes.run();
    return done;
  }
  catch_interruptions();  // finished files remain complete
  return run_command->parsed() ? run_suite(folder, filters, options)
                               : accept(folder, names, options);
}

}  // namespace
}  // namespace groundray::golden

int main(int argc, char** argv) {
  try {
    const int code = groundray::golden::run(argc, argv);
    if (groundray::flush_output()) return code;
    groundray::print_error("groundray-golden: standard output cannot be written\n");
  } catch (const groundray::Interrupted&) {
    groundray::print_error("\ngroundray-golden: interrupted\n");
    return groundray::golden::interrupted;
  } catch (const std::bad_alloc&) {
    groundray::print_error("groundray-golden: there is not enough memory\n");
  } catch (const std::exception& error) {
    groundray::print_error("groundray-golden: {}\n", error.what());
  }
  return groundray::golden::failed;
}
