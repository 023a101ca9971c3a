#include <fmt/format.h>
#include <gnu/libc-version.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "apps/golden/compare/compare_command.h"
#include "apps/golden/conform/conform_commands.h"
#include "apps/golden/report.h"
#include "apps/golden/suite/golden_case.h"
#include "apps/golden/suite/suite.h"
#include "apps/scan/usage_fault.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/print_error.h"
#include "core/near_names.h"
#include "core/own_folder.h"

namespace groundray::golden {
namespace {

namespace fs = std::filesystem;

constexpr int done = 0;
constexpr int failed = 1;
constexpr int interrupted = 130;

fs::path program_folder() {
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

// Returns the C library, compiler and processor of this program.
std::string made_with() {
#ifdef __clang__
  const std::string compiler = fmt::format("clang {}", __clang_major__);
#else
  const std::string compiler = fmt::format("gcc {}", __GNUC__);
#endif
#ifdef __x86_64__
  const char* const processor = "x86_64";
#else
  const char* const processor = "another processor";
#endif
  return fmt::format("glibc {}, {}, {}", gnu_get_libc_version(), compiler, processor);
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

  fs::path folder = own_folder() / "test/golden";
  SuiteOptions options{.program = program_folder() / "groundray",
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
