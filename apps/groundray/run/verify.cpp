#include "apps/groundray/run/verify.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "apps/dataset/dataset_summary.h"
#include "apps/dataset/dataset_text.h"
#include "apps/groundray/run/file_check.h"
#include "apps/groundray/run/folder_lock.h"
#include "apps/groundray/run/journal.h"
#include "apps/interruption.h"
#include "core/error.h"
#include "core/progress.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// The files of a dataset, gone through in the order of dataset.yaml.
class Verification {
 public:
  explicit Verification(const fs::path& folder)
      : folder_(folder),
        summary_(read_summary(folder)),
        progress_(stderr, "frames checked", summary_.done) {}

  void run() {
    check_record();
    flush();
    if (fs::exists(folder_ / journal_file)) {
      add_fault(journal_file,
                "a run was cut off; `groundray generate --resume` checks its frames and goes on");
      expected_.emplace(journal_file);
    } else if (summary_.done < summary_.asked_for) {
      faults_.push_back(fmt::format(
          "{}: incomplete: {} of {} frames are there; `groundray generate --resume` makes the rest",
          folder_.string(), summary_.done, summary_.asked_for));
    }
    find_strangers();
  }

  const std::vector<std::string>& faults() const { return faults_; }
  std::size_t files() const { return files_; }
  std::uint64_t bytes() const { return bytes_; }

 private:
  struct Task {
    std::string path;
    FileSum sum;
    std::optional<std::string> fault;
  };

  void add_fault(std::string_view path, std::string_view words) {
    faults_.push_back(fmt::format("{}: {}", (folder_ / path).string(), words));
  }

  void add_task(std::string path, const FileSum& sum) {
    constexpr std::size_t block = 256;  // how many files are checked at a time
    expected_.insert(path);
    tasks_.push_back({std::move(path), sum, {}});
    if (tasks_.size() == block) flush();
  }

  void flush() {
    stop_if_interrupted();
    tbb::parallel_for(std::size_t{0}, tasks_.size(), [this](std::size_t i) {
      tasks_[i].fault = fault_of(folder_ / tasks_[i].path, tasks_[i].sum);
    });
    for (const Task& task : tasks_) {
      if (task.fault) add_fault(task.path, *task.fault);
      bytes_ += task.sum.bytes;
    }
    files_ += tasks_.size();
    tasks_.clear();
    progress_.update(frames_);
  }

  void check_record() {
    DatasetText text(folder_);
    while (const auto line = text.next_entry()) {
      const auto entry = parse_entry(*line);
      const auto stem = entry ? summary_.stem_of(*entry) : std::nullopt;
      if (!stem) {
        add_fault(fmt::format("{}:{}", dataset_file, text.line()), "not as it was written");
        continue;
      }
      if (!entry->is_done) continue;
      ++frames_;
      if (entry->files.empty()) {
        add_fault(fmt::format("{}:{}", dataset_file, text.line()),
                  "the frame is without checksums: an earlier version made it");
      }
      for (const ProductSum& file : entry->files) add_task(*stem + file.suffix, file.sum);
    }
    for (const NamedSum& file : text.files()) add_task(file.path, file.sum);
    expected_.emplace(dataset_file);
    ++files_;
    if (!text.is_intact()) add_fault(dataset_file, "changed since it was written, or cut short");
  }

  // A run that goes on or was cut off has files that are not listed yet.
  void find_strangers() {
    if (expected_.contains(std::string(journal_file))) return;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_)) {
      if (entry.is_directory() && !entry.is_symlink()) continue;
      const std::string path = entry.path().lexically_relative(folder_).generic_string();
      if (!expected_.contains(path)) add_fault(path, "not a file of the dataset");
    }
  }

  fs::path folder_;
  DatasetSummary summary_;
  Progress progress_;
  std::set<std::string> expected_;
  std::vector<Task> tasks_;
  std::vector<std::string> faults_;
  std::size_t files_ = 0, frames_ = 0;
  std::uint64_t bytes_ = 0;
};

// Whether all is well.
bool verify_one(const fs::path& folder) {
  const FolderLock lock(folder, FolderLock::Use::Read);
  Verification verification(folder);
  verification.run();
  for (const std::string& fault : verification.faults()) fmt::print("{}\n", fault);
  fmt::print("{}: {} files of {:.1f} MiB checked, {}\n", folder.string(), verification.files(),
             static_cast<double>(verification.bytes()) / (1 << 20),
             verification.faults().empty()
                 ? "all as they were written"
                 : fmt::format("{} faults", verification.faults().size()));
  return verification.faults().empty();
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
    }
    if (!is_sound) ++at_fault;
  }
  if (at_fault > 0) {
    throw Error("{} of {} datasets {} at fault; `groundray generate --resume` makes frames again",
                at_fault, datasets.size(), at_fault == 1 ? "is" : "are");
  }
}

}  // namespace groundray
