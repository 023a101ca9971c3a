#include "apps/golden/suite/suite.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <tinyxml2.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "apps/golden/suite/checks.h"
#include "apps/golden/suite/columns.h"
#include "apps/golden/suite/stored.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/open_file.h"
#include "core/progress.h"

namespace groundray::golden {
namespace {

// Runs a program and waits until it ends.
// @param command  the program's path and its arguments.
// @param log  file for standard output and standard error; replaced.
// @return its exit code, or 128 plus the number of the signal that ended it.
int run_process(const std::vector<std::string>& command, const std::filesystem::path& log) {
  try {
    close(create_file(log));
  } catch (const std::system_error& fault) {
    throw Error("{}: cannot be written: {}", log.string(), fault.code().message());
  }
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t to_log{};
  posix_spawn_file_actions_init(&to_log);
  posix_spawn_file_actions_addopen(&to_log, STDOUT_FILENO, log.c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&to_log, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int fault = posix_spawn(&child, arguments[0], &to_log, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&to_log);
  if (fault != 0)
    throw Error("{}: cannot be started: {}", command[0], std::generic_category().message(fault));
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw Error("{}: waiting for the process failed", command[0]);
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// Adds the position of each row: `row` from 0 and, for images, the pixel's `u` (to the right) and
// `v` (down).
void name_places(Columns& columns) {
  const auto add = [&](const char* name, const auto& place) {
    std::vector<double> values(columns.rows);
    for (std::size_t i = 0; i < columns.rows; ++i) values[i] = static_cast<double>(place(i));
    columns.all.push_back({name, std::move(values), Stored::Whole});
  };
  add("row", [](std::size_t i) { return i; });
  if (columns.size_px.x == 0) return;
  const auto width = static_cast<std::size_t>(columns.size_px.x);
  add("u", [width](std::size_t i) { return i % width; });
  add("v", [width](std::size_t i) { return i / width; });
}

// Drops the rows where the condition is 0.
void keep(const std::string& condition, Columns& columns) {
  const std::vector<double> kept = evaluate(condition, columns);
  std::size_t rows = 0;
  for (const double is_kept : kept) {
    if (std::isnan(is_kept)) throw Error("rows: '{}' is not a number in some row", condition);
    rows += is_kept != 0 ? 1 : 0;
  }
  for (Columns::Column& column : columns.all) {
    std::size_t to = 0;
    for (std::size_t from = 0; from < kept.size(); ++from) {
      if (kept[from] != 0) column.values[to++] = column.values[from];
    }
    column.values.resize(rows);
  }
  if (rows < columns.rows) columns.size_px = {0, 0};  // no longer an image
  columns.rows = rows;
}

// Returns the columns, with those that the case defines, of the rows that it selects.
Columns chosen(const ProductChecks& product, Columns columns) {
  name_places(columns);
  for (const auto& [name, formula] : product.names) {
    if (columns.find(name) != nullptr) throw Error("let: column '{}' already exists", name);
    columns.all.push_back({name, evaluate(formula, columns), Stored::Double});
  }
  if (!product.rows.empty()) keep(product.rows, columns);
  return columns;
}

struct Checker {
  const GoldenCase& golden;
  const ProductChecks& product;
  const Columns& whole;
  const Columns& rows;
  const std::string& because;
  Section& into;

  void operator()(const RowsCheck& check) const { check_rows(check, because, rows, into); }
  void operator()(const FigureCheck& check) const { check_figure(check, because, rows, into); }
  void operator()(const ExactCheck&) const {
    check_equal(whole, read_columns(stored_file(golden, product.product)), because, into);
  }
  void operator()(const StatisticalCheck& check) const {
    check_statistically(check, because, whole,
                        read_columns(stored_moments(golden, product.product)), into);
  }
};

void fail(const std::string& what, const std::string& why, Section& into) {
  hold(into, fmt::format("{}: {}", what, why), 1, "fault", 0, "");
}

void check_product(const GoldenCase& golden, const ProductChecks& product,
                   const std::filesystem::path& dataset, Section& into) {
  Columns whole, rows;
  try {
    whole = read_columns(dataset / product.product);
    rows = chosen(product, whole);
  } catch (const std::exception& fault) {
    return fail(product.product, fault.what(), into);
  }
  for (const Check& check : product.checks) {
    const std::size_t before = into.measures.size();
    try {
      std::visit(Checker{golden, product, whole, rows, check.because, into}, check.what);
    } catch (const std::exception& fault) {
      fail(fmt::format("check of line {}", check.line), fault.what(), into);
    }
    for (std::size_t i = before; i < into.measures.size(); ++i)
      into.measures[i].name = product.product + ": " + into.measures[i].name;
  }
}

// Checks a dataset against the expectations of its case. A missing or damaged file, or a formula
// that cannot be evaluated, fails the check that needs it.
Section check_case(const GoldenCase& golden, const std::filesystem::path& dataset) {
  Section section{.title = golden.name, .text = golden.title};
  for (const ProductChecks& product : golden.products)
    check_product(golden, product, dataset, section);
  section.verdict = verdict_of(section.measures);
  return section;
}

using Clock = std::chrono::steady_clock;

// Replaces all but printable ASCII, newlines and tabs: a failing program may print anything, and
// XML permits no control characters.
std::string printable(std::string text) {
  std::ranges::replace_if(
      text,
      [](char c) {
        const auto byte = static_cast<unsigned char>(c);
        return byte > 0x7e || (byte < 0x20 && c != '\n' && c != '\t');
      },
      '?');
  return text;
}

std::string tail_of(const std::filesystem::path& log) {
  constexpr std::size_t most = 2000;
  const std::string text = printable(read_text(log));
  return text.size() <= most ? text : "..." + text.substr(text.size() - most);
}

// Generates a case's dataset.
// @return the program's output if it failed.
std::optional<std::string> make_dataset(const GoldenCase& golden, const SuiteOptions& options,
                                        const std::filesystem::path& dataset,
                                        std::optional<std::uint64_t> seed) {
  std::filesystem::remove_all(dataset);
  std::filesystem::create_directories(dataset.parent_path());
  const std::filesystem::path log = dataset.parent_path() / "log.txt";
  std::vector<std::string> command{options.program.string(), "generate", golden.scene().string(),
                                   "-o", dataset.string()};
  if (seed) command.insert(command.end(), {"--seed", std::to_string(*seed)});
  const int code = run_process(command, log);
  if (is_interrupted()) throw Interrupted{};
  if (code == 0) return std::nullopt;
  return fmt::format("groundray ended with code {}: {}", code, tail_of(log));
}

// Locks a folder against other runs during its lifetime.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    const std::filesystem::path file = folder / ".lock";
    descriptor_ = open(file.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644);
    if (descriptor_ < 0)
      throw Error("{}: cannot be written: choose another folder with -o", file.string());
    if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
    close(descriptor_);
    throw Error("{}: another run writes there: wait, or choose another folder with -o",
                folder.string());
  }
  ~FolderLock() { close(descriptor_); }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_ = -1;
};

Section run_case(const GoldenCase& golden, const SuiteOptions& options) {
  const std::filesystem::path dataset = options.out / golden.name / "dataset";
  const auto begin = Clock::now();
  const auto fault = make_dataset(golden, options, dataset, std::nullopt);
  const double took_s = std::chrono::duration<double>(Clock::now() - begin).count();
  Section section{.title = golden.name, .verdict = Verdict::Failed, .text = golden.title};
  if (fault) {
    hold(section, "groundray makes the dataset", 1, "fault", 0, *fault);
  } else {
    section = check_case(golden, dataset);
  }
  tell(section, "time to generate", took_s, "s");
  return section;
}

// Runs `work(i)` for each index below `count` in several threads.
// @throws the first exception that any of them threw.
template <typename Work>
void in_threads(std::size_t count, unsigned threads, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::mutex guard;
  std::exception_ptr fault;
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard hold(guard);
        if (!fault) fault = std::current_exception();
        next = count;
      }
    }
  };
  {
    std::vector<std::jthread> pool;
    for (unsigned i = 0; i < threads; ++i) pool.emplace_back(run);
  }
  if (fault) std::rethrow_exception(fault);
}

}  // namespace

Report run_cases(const std::vector<GoldenCase>& cases, const SuiteOptions& options) {
  const FolderLock lock(options.out);
  Report report{.title = "The golden suite of groundray", .facts = {}, .sections = {}};
  report.sections.resize(cases.size());
  Progress progress(stderr, "cases", cases.size());
  std::mutex guard;
  std::uint64_t done = 0;
  in_threads(cases.size(), options.jobs, [&](std::size_t i) {
    Section section = run_case(cases[i], options);
    const std::lock_guard hold(guard);
    report.sections[i] = std::move(section);
    progress.update(++done);
  });
  return report;
}

void accept_case(const GoldenCase& golden, const SuiteOptions& options) {
  const FolderLock lock(options.out);
  store(golden, [&](std::uint64_t seed) {
    const std::filesystem::path dataset = options.out / golden.name / "accepted";
    std::optional<std::uint64_t> own;
    if (seed != 0) own = seed;
    if (const auto fault = make_dataset(golden, options, dataset, own))
      throw Error("{}: {}", golden.name, *fault);
    return dataset;
  });
}

void write_junit(const std::filesystem::path& path, const Report& report) {
  tinyxml2::XMLDocument document;
  document.InsertEndChild(document.NewDeclaration());
  tinyxml2::XMLElement* suites = document.NewElement("testsuites");
  document.InsertEndChild(suites);
  for (const Section& section : report.sections) {
    tinyxml2::XMLElement* suite = suites->InsertNewChildElement("testsuite");
    suite->SetAttribute("name", section.title.c_str());
    std::int64_t tests = 0, failures = 0;
    for (const Measure& measure : section.measures) {
      if (measure.verdict == Verdict::Told) continue;
      ++tests;
      tinyxml2::XMLElement* test = suite->InsertNewChildElement("testcase");
      test->SetAttribute("classname", section.title.c_str());
      test->SetAttribute("name", printable(measure.name).c_str());
      if (measure.verdict == Verdict::Passed) continue;
      ++failures;
      const std::string message =
          fmt::format("{} {}, but at most {} because: {}", measure.value, measure.unit,
                      measure.limit.value_or(0), measure.because);
      test->InsertNewChildElement("failure")->SetAttribute("message", message.c_str());
    }
    suite->SetAttribute("tests", tests);
    suite->SetAttribute("failures", failures);
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  write_text(path, printer.CStr());
}

}  // namespace groundray::golden
