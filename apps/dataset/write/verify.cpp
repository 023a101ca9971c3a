#include "apps/dataset/write/verify.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "apps/dataset/dataset_text.h"
#include "apps/dataset/file_sum.h"
#include "apps/dataset/write/dataset_folder.h"
#include "apps/dataset/write/journal.h"
#include "apps/scene/interruption.h"
#include "core/folder_names.h"
#include "core/io/text_lines.h"
#include "core/progress.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view no_file = "not a file of the dataset";

// Check of the files of a dataset in the order of dataset.yaml.
class DatasetCheck {
 public:
  DatasetCheck(const fs::path& folder, const std::function<void(const std::string&)>& report,
               std::FILE* shown)
      : folder_(folder),
        report_(report),
        shown_(shown),
        summary_(read_summary(folder)),
        expected_(summary_) {}

  Verification run() {
    check_record();
    std::error_code fault;
    const bool is_open = fs::exists(folder_ / journal_file, fault);
    DatasetSummary now = summary_;
    if (is_open) count_journal(folder_ / journal_file, now);
    result_.done = now.done;
    result_.asked_for = now.asked_for;
    if (is_open || fault) {
      tell(journal_file, fmt::format("a run was interrupted, with {} of {} frames complete; "
                                     "`groundray generate --resume` checks them and continues",
                                     now.done, now.asked_for));
    } else if (summary_.done < summary_.asked_for) {
      tell("", fmt::format(
                   "incomplete: {} of {} frames are complete; `groundray generate --resume` adds "
                   "the rest, and `groundray merge --resume` continues an interrupted merge",
                   summary_.done, summary_.asked_for));
    }
    // A run that is active or was interrupted has files that are not listed yet.
    if (!is_open) find_strangers("", Reached::Directly);
    return result_;
  }

 private:
  struct Task {
    std::string path;
    FileSum sum;
    std::optional<std::string> fault;
  };

  void tell(std::string_view path, std::string_view words) {
    report_(fmt::format("{}: {}", (path.empty() ? folder_ : folder_ / path).string(), words));
    ++result_.faults;
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
    // Line of the progress display.
    bool is_line_open = shown_ != nullptr && isatty(fileno(shown_)) == 1;
    for (const Task& task : tasks_) {
      result_.bytes += task.sum.bytes;
      if (!task.fault) continue;
      if (std::exchange(is_line_open, false)) std::fputc('\n', shown_);
      tell(task.path, *task.fault);
    }
    result_.files += tasks_.size();
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
    progress_.emplace(shown_, "frames checked", summary_.done);
    DatasetText text(folder_);
    while (const auto line = text.next_entry()) check_entry(*line, text.line());
    for (const NamedSum& file : text.files()) {
      expected_.add(file);
      add_task(file.path, file.sum);
    }
    ++result_.files;
    flush();
    progress_.reset();
    if (!text.is_intact()) tell(dataset_file, "changed since it was written, or truncated");
  }

  enum class Reached { Directly, ByLink };

  // Reports unexpected files in a folder of the dataset and its subfolders. Beyond links, which may
  // lead anywhere, only expected folders are entered.
  void find_strangers(const std::string& path, Reached how) {
    std::error_code fault;
    std::vector<std::pair<std::string, Reached>> folders;
    for (const std::string& name : names_in(path.empty() ? folder_ : folder_ / path, fault)) {
      stop_if_interrupted();
      std::string child = path.empty() ? name : fmt::format("{}/{}", path, name);
      std::error_code ignored;
      const fs::path place = folder_ / child;
      const Reached reached = fs::is_symlink(place, ignored) ? Reached::ByLink : how;
      const bool is_walked = fs::is_directory(place, ignored) &&
                             (reached == Reached::Directly || expected_.has_folder(child));
      if (is_walked) {
        folders.emplace_back(std::move(child), reached);
      } else if (const auto words = expected_.fault_of(child)) {
        tell(child, *words);
      }
    }
    if (fault) tell(path, "the folder cannot be read: " + fault.message());
    for (const auto& [folder, reached] : folders) find_strangers(folder, reached);
  }

  const fs::path& folder_;
  const std::function<void(const std::string&)>& report_;
  std::FILE* shown_;
  DatasetSummary summary_;
  ExpectedFiles expected_;
  std::optional<Progress> progress_;  // while files are checked
  std::vector<Task> tasks_;
  std::size_t frames_ = 0;
  Verification result_;
};

}  // namespace

ExpectedFiles::ExpectedFiles(const DatasetSummary& dataset)
    : dataset_(dataset), runs_(dataset.sensors.size()) {
  files_.emplace(dataset_file);
  for (const DatasetSummary::Sensor& sensor : dataset.sensors)
    add_folders(fmt::format("{}/{}/", sensor.kind, sensor.name));
}

// Adds all folders in a path.
void ExpectedFiles::add_folders(const std::string& path) {
  for (std::size_t slash = path.find('/'); slash != std::string::npos;
       slash = path.find('/', slash + 1))
    folders_.insert(path.substr(0, slash));
}

bool ExpectedFiles::add(const FrameEntry& frame) {
  const auto sensor = dataset_.number_of(frame.sensor);
  if (!sensor || !dataset_.has(dataset_.sensors[*sensor], frame.frame)) return false;
  std::vector<Run>& runs = runs_[*sensor];
  if (!runs.empty() && frame.frame < runs.back().end) return false;
  Suffixes suffixes;
  for (const ProductSum& file : frame.files) suffixes.insert(file.suffix);
  const Suffixes* const kind = &*kinds_.insert(std::move(suffixes)).first;
  if (!runs.empty() && runs.back().end == frame.frame && runs.back().suffixes == kind)
    ++runs.back().end;
  else
    runs.push_back({frame.frame, frame.frame + 1, kind});
  return true;
}

void ExpectedFiles::add(const NamedSum& file) {
  files_.insert(file.path);
  add_folders(file.path);
}

std::optional<std::string> ExpectedFiles::fault_of(std::string_view path) const {
  if (files_.contains(path)) return std::nullopt;
  const std::size_t slash = path.rfind('/');
  if (slash == std::string_view::npos) return std::string(no_file);
  const std::string_view folder = path.substr(0, slash), name = path.substr(slash + 1);
  const auto sensor = std::ranges::find_if(dataset_.sensors, [&](const auto& each) {
    return folder == fmt::format("{}/{}", each.kind, each.name);
  });
  const std::size_t digits = std::min(name.find_first_not_of("0123456789"), name.size());
  const auto number = number_of<std::int64_t>(name.substr(0, digits));
  if (sensor == dataset_.sensors.end() || !number || !dataset_.has(*sensor, *number) ||
      fmt::format("{:06}", *number) != name.substr(0, digits))
    return std::string(no_file);
  const std::vector<Run>& runs = runs_[static_cast<std::size_t>(sensor - dataset_.sensors.begin())];
  const auto run = std::ranges::upper_bound(runs, *number, {}, &Run::end);
  if (run == runs.end() || *number < run->begin)
    return "of an unfinished frame; --resume of `groundray generate`, or of `groundray merge` if "
           "that was interrupted, continues with it";
  if (run->suffixes->contains(name.substr(digits))) return std::nullopt;
  return std::string(no_file);
}

Verification verify(const fs::path& dataset, const std::function<void(const std::string&)>& report,
                    std::FILE* progress) {
  const FolderLock lock(dataset, FolderLock::Use::Read);
  return DatasetCheck(dataset, report, progress).run();
}

}  // namespace groundray
