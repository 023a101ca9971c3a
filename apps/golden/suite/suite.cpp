#include "apps/golden/suite/suite.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <tinyxml2.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "apps/golden/suite/check_case.h"
#include "apps/golden/suite/process.h"
#include "apps/golden/suite/stored.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/progress.h"

namespace groundray::golden {
namespace {

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
    descriptor_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
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
