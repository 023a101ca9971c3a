#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "apps/golden/compare/compare_command.h"
#include "apps/golden/report.h"
#include "apps/golden/suite/exact_match.h"
#include "apps/golden/suite/golden_case.h"
#include "apps/golden/suite/suite.h"
#include "apps/scene/interruption.h"
#include "apps/scene/simulation.h"
#include "core/error.h"

namespace {

namespace fs = std::filesystem;
using groundray::golden::CompareCommand;
using groundray::golden::Measure;
using groundray::golden::Report;
using groundray::golden::Section;
using groundray::golden::SuiteOptions;
using groundray::golden::Verdict;

constexpr int done = 0;
constexpr int failed = 1;
constexpr int wrong_usage = 2;
constexpr int interrupted = 130;

fs::path own_folder() {
  std::error_code ignored;
  return fs::read_symlink("/proc/self/exe", ignored).parent_path();
}

void print(const Section& section) {
  fmt::print("{} {}\n", section.verdict == Verdict::Passed ? "passed" : "FAILED", section.title);
  for (const Measure& measure : section.measures) {
    if (measure.verdict != Verdict::Failed) continue;
    fmt::print("       {}: {:.6g} {}, but at most {:.6g} because: {}\n", measure.name,
               measure.value, measure.unit, measure.limit.value_or(0), measure.because);
  }
}

int run_suite(const fs::path& folder, const std::vector<std::string>& filters,
              const SuiteOptions& options) {
  for (const char* name : {"report.html", "report.json", "junit.xml"})
    fs::remove(options.out / name);  // left by an earlier run
  Report report =
      groundray::golden::run_cases(groundray::golden::read_cases(folder, filters), options);
  report.facts = {{"version", GROUNDRAY_VERSION},
                  {"program", options.program.string()},
                  {"made with", groundray::golden::made_with()},
                  {"cases", folder.string()}};
  std::ranges::for_each(report.sections, print);
  groundray::golden::write_html(options.out / "report.html", report);
  groundray::golden::write_json(options.out / "report.json", report);
  groundray::golden::write_junit(options.out / "junit.xml", report);
  const auto good = std::ranges::count(report.sections, Verdict::Passed, &Section::verdict);
  fmt::print("{} of {} cases passed; see {}\n", good, report.sections.size(),
             (options.out / "report.html").string());
  return good == std::ssize(report.sections) ? done : failed;
}

int accept(const fs::path& folder, const std::vector<std::string>& names,
           const SuiteOptions& options) {
  for (const std::string& name : names) {
    const fs::path place = (folder / name / "").parent_path();  // drops a trailing slash
    groundray::golden::accept_case(groundray::golden::read_case(place), options);
    fmt::print("stored: {}\n", (place / "expected").string());
  }
  return done;
}

int run(int argc, char** argv) {
  CLI::App app(
      "groundray-golden checks groundray's results for small scenes against closed forms, golden "
      "files and statistics, and compares scans, images, DEMs and meshes from any source.");
  app.footer(
      "A first run:  groundray-golden run\n"
      "Exit codes:   0 all passed, 1 failed, 2 wrong usage, 130 interrupted");
  app.set_version_flag("--version", "groundray-golden " GROUNDRAY_VERSION);
  app.require_subcommand(1);

  fs::path folder = groundray::source_folder() / "test/golden";
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

  const CompareCommand compare(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? done : wrong_usage;
  }
  if (compare.is_asked_for()) return compare.run() == Verdict::Failed ? failed : done;
  groundray::catch_interruptions();  // finished files remain complete
  return run_command->parsed() ? run_suite(folder, filters, options)
                               : accept(folder, names, options);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const groundray::Interrupted&) {
    fmt::print(stderr, "\ngroundray-golden: interrupted\n");
    return interrupted;
  } catch (const std::exception& error) {
    fmt::print(stderr, "groundray-golden: {}\n", error.what());
  }
  return failed;
}
