#include "apps/golden/conform/conform_commands.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/golden/conform/conform.h"
#include "apps/scan/number_checks.h"
#include "core/io/print_error.h"

namespace groundray::golden {

namespace fs = std::filesystem;

namespace {

void print_measure(const Measure& measure) {
  print_text(stdout, "{}{}: {:.6g}{}{}{}\n", measure.verdict == Verdict::Failed ? "FAILED " : "",
             measure.name, measure.value, measure.unit.empty() ? "" : " ", measure.unit,
             measure.limit ? fmt::format(", at most {:.6g}", *measure.limit) : "");
}

}  // namespace

void publish(const Report& report, const fs::path& out) {
  for (const Section& section : report.sections) {
    if (report.sections.size() > 1) {
      print_text(stdout, "{} {}\n", section.verdict == Verdict::Passed ? "passed" : "FAILED",
                 section.title);
    }
    const std::vector<Measure> main = main_measures(section);
    if (!section.headline.empty()) {
      print_text(stdout, "{}\n", first_words(section));
      std::ranges::for_each(main, print_measure);
      print_text(stdout, "\n");
    }
    if (!section.text.empty()) print_text(stdout, "{}\n", section.text);
    for (const Measure& measure : section.measures) {
      if (std::ranges::find(main, measure.name, &Measure::name) == main.end())
        print_measure(measure);
    }
  }
  fs::create_directories(out);
  write_html(out / "report.html", report);
  write_json(out / "report.json", report);
  print_text(stdout, "see {}\n", (out / "report.html").string());
}

void PassesCommand::add_to(CLI::App* command) {
  command->add_option("DEM", dem, "DEM (GeoTIFF, VRT, HGT, ...)")->required();
  command->add_option("-o,--output", out, "A new or empty folder")->required();
  command
      ->add_option("--tolerance-m", settings.tolerance_m, "Vertical deviation permitted everywhere")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      ->add_option("--angle-rad", settings.angle_rad,
                   "Deviation permitted for each metre of distance from the viewpoint")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      ->add_option("--viewpoint-m", viewpoint_m,
                   "X,Y,Z in D, the DEM's frame; by default 2 m above its middle")
      ->delimiter(',')
      ->expected(3);
  command
      ->add_option("--block-cells", settings.block_cells,
                   "Cells along a leaf's side: a power of two from 2 to 64")
      ->capture_default_str();
  command->add_option("--rays", settings.rays, "Number of rays")
      ->check(CLI::Range(std::size_t{1}, std::size_t{100'000'000}))
      ->capture_default_str();
  command->add_option("--seed", settings.seed.value, "Seed of the rays")
      ->check(whole())
      ->capture_default_str();
}

void PassesCommand::run() {
  if (!viewpoint_m.empty()) settings.viewpoint_m = {viewpoint_m[0], viewpoint_m[1], viewpoint_m[2]};
  settings.commit = GROUNDRAY_COMMIT;
  write_pass_folder(dem, settings, out);
  print_text(stdout, "{}: judge another mesher or tracer with groundray-golden conform {} THEIRS\n",
             (out / "manifest.json").string(), out.string());
}

void ConformCommand::add_to(CLI::App* command) {
  command->add_option("PASSES", passes, "Folder that groundray-golden passes has written")
      ->required();
  command
      ->add_option("THEIRS", theirs,
                   "Folder with the other's manifest.json and arrays (docs/guide/gpu.md)")
      ->required();
  command->add_option("-o,--output", out, "Folder for report.html and report.json")
      ->capture_default_str();
}

Verdict ConformCommand::run() const {
  check_report_folder(out);
  const Report report = judge_conformity(passes, theirs);
  publish(report, out);
  const bool passed = std::ranges::all_of(
      report.sections, [](const Section& section) { return section.verdict == Verdict::Passed; });
  return passed ? Verdict::Passed : Verdict::Failed;
}

}  // namespace groundray::golden
