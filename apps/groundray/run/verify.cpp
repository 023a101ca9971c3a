#include "apps/groundray/run/verify.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "apps/dataset/dataset_summary.h"
#include "apps/dataset/dataset_text.h"
#include "apps/groundray/run/expected_files.h"
#include "apps/groundray/run/file_check.h"
#include "apps/groundray/run/folder_lock.h"
#include "apps/groundray/run/journal.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/progress.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Checks the files of a dataset in the order of dataset.yaml. Prints faults immediately.
class Verification {
 public:
  explicit Verification(const fs::path& folder)
      : folder_(folder), summary_(read_summary(folder)), expected_(summary_) {}

  void run() {
    check_record();
    std::error_code fault;
    const bool is_open = fs::exists(folder_ / journal_file, fault);
    if (is_open || fault) {
      tell(journal_file,
           "a run was interrupted; `groundray generate --resume` checks its frames and continues");
    } else if (summary_.done < summary_.asked_for) {
      tell("", fmt::format(
                   "incomplete: {} of {} frames are complete; `groundray generate --resume` adds "
                   "the rest, and `groundray merge --resume` continues an interrupted merge",
                   summary_.done, summary_.asked_for));
    }
    // A run that is active or was interrupted has files that are not listed yet.
    if (!is_open) find_strangers("");
  }

  std::size_t faults() const { return faults_; }
  std::size_t files() const { return files_; }
  std::uint64_t bytes() const { return bytes_; }

 private:
  struct Task {
    std::string path;
    FileSum sum;
    std::optional<std::string> fault;
  };

  void tell(std::string_view path, std::string_view words) {
    fmt::print("{}: {}\n", (path.empty() ? folder_ : folder_ / path).string(), words);
    ++faults_;
  }

  void add_task(std::string path, const FileSum& sum) {
    constexpr std::size_t block = 256;  // number of files checked at a time
    tasks_.push_back({std::move(path), sum, {}});
    if (tasks_.size() == block) flush();
  }

  void flush() {
    tbb::parallel_for(std::size_t{0}, tasks_.size(), [this](std::size_t i) {
      stop_if_interrupted();
      tasks_[i].fault = fault_of(folder_ / tasks_[i].path, tasks_[i].sum);
    });
    bool is_line_open = progress_ && isatty(STDERR_FILENO) == 1;  // line of the progress display
    for (const Task& task : tasks_) {
      bytes_ += task.sum.bytes;
      if (!task.fault) continue;
      if (std::exchange(is_line_open, false)) std::fputc('\n', stderr);
      tell(task.path, *task.fault);
    }
    std::fflush(stdout);
    files_ += tasks_.size();
    tasks_.clear();
    progress_->update(frames_);
  }

  void check_entry(const std::string& line, std::size_t number) {
    const std::string place = fmt::format("{}:{}", dataset_file, number);
    const auto entry = parse_entry(line);
    const auto stem = entry ? summary_.stem_of(*entry) : std::nullopt;
    if (!stem) return tell(place, "changed since it was written");
    if (!entry->is_done) return;
    if (!expected_.add(*entry))
      return tell(place, "a frame that does not belong to the run, or is listed twice");
    ++frames_;
    if (entry->files.empty())
      tell(place, "the frame has no checksums: an earlier version wrote it");
    for (const ProductSum& file : entry->files) add_task(*stem + file.suffix, file.sum);
  }

  void check_record() {
    progress_.emplace(stderr, "frames checked", summary_.done);
    DatasetText text(folder_);
    while (const auto line = text.next_entry()) check_entry(*line, text.line());
    for (const NamedSum& file : text.files()) {
      expected_.add(file);
      add_task(file.path, file.sum);
    }
    ++files_;
    flush();
    progress_.reset();
    if (!text.is_intact()) tell(dataset_file, "changed since it was written, or truncated");
  }

  // Reports unexpected files in a folder of the dataset and its subfolders.
  void find_strangers(const std::string& path) {
    std::error_code fault;
    fs::directory_iterator it(path.empty() ? folder_ : folder_ / path, fault);
    std::vector<std::string> folders;
    for (; !fault && it != fs::directory_iterator(); it.increment(fault)) {
      stop_if_interrupted();
      const std::string name = it->path().filename().string();
      std::string child = path.empty() ? name : fmt::format("{}/{}", path, name);
      std::error_code ignored;
      const bool is_walked =
          it->is_directory(ignored) && (!it->is_symlink(ignored) || expected_.has_folder(child));
      if (is_walked) {
        folders.push_back(std::move(child));
      } else if (const auto words = expected_.fault_of(child)) {
        tell(child, *words);
      }
    }
    if (fault) tell(path, "the folder cannot be read: " + fault.message());
    for (const std::string& each : folders) find_strangers(each);
  }

  fs::path folder_;
  DatasetSummary summary_;
  ExpectedFiles expected_;
  std::optional<Progress> progress_;  // while files are checked
  std::vector<Task> tasks_;
  std::size_t faults_ = 0, files_ = 0, frames_ = 0;
  std::uint64_t bytes_ = 0;
};

// Returns true if there are no faults.
bool verify_one(const fs::path& folder) {
  const FolderLock lock(folder, FolderLock::Use::Read);
  Verification verification(folder);
  verification.run();
  fmt::print("{}: {} files of {:.1f} MiB checked, {}\n", folder.string(), verification.files(),
             static_cast<double>(verification.bytes()) / (1 << 20),
             verification.faults() == 0 ? "all unchanged"
                                        : fmt::format("{} fault{}", verification.faults(),
                                                      verification.faults() == 1 ? "" : "s"));
  return verification.faults() == 0;
}

}  // namespace

void verify(const std::vector<fs::path>& datasets) {
  std::size_t at_fault = 0;
  for (const fs::path& dataset : datasets) {
    bool is_sound = false;
    try {
      is_sound = verify_one(dataset);
    } catch (const Error& error) {
      fmt::print("{}\n", error.what());
    } catch (const std::system_error& error) {
      fmt::print("{}: {}\n", dataset.string(), error.what());
    }
    if (!is_sound) ++at_fault;
  }
  if (at_fault > 0) {
    throw Error(
        "{} of {} datasets {} damaged or incomplete; `groundray generate --resume` creates frames "
        "again",
        at_fault, datasets.size(), at_fault == 1 ? "is" : "are");
  }
}

}  // namespace groundray
