#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "apps/dataset/dataset_reader.h"
#include "apps/dataset/dataset_text.h"
#include "apps/dataset/frame_entry.h"
#include "apps/dataset/write/journal.h"
#include "apps/dataset/write/verify.h"
#include "core/error.h"

namespace {

namespace fs = std::filesystem;

/// A dataset's folder of this process, removed when the process ends. It has links to itself, to
/// its parent and to nothing, and there are poses and calibrations in it and beside it.
class Folder {
 public:
  Folder()
      : root_(fs::temp_directory_path() / ("dataset_fuzz_" + std::to_string(getpid()))),
        path_(root_ / "run") {
    fs::create_directories(path_ / "lidar/top");
    fs::create_directories(path_ / "camera");
    for (const fs::path& place : {path_ / "poses", path_ / "calibration", root_})
      write_lidar(place);
    fs::create_directory_symlink("..", path_ / "lidar/front");
    fs::create_directory_symlink(".", path_ / "camera/eye");
    fs::create_symlink("../../dataset.yaml", path_ / "lidar/top/000000.ply");
    fs::create_symlink("nowhere", path_ / "lidar/top/000001.ply");
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(root_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  static void write_lidar(const fs::path& folder) {
    fs::create_directories(folder);
    for (const char* name : {"top", "front"}) {
      std::ofstream(folder / (std::string(name) + ".tum")) << "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n";
      std::ofstream(folder / (std::string(name) + ".yaml")) << "range_noise_sigma_m: 0\n";
    }
  }

  fs::path root_, path_;
};

void require(bool holds) {
  if (!holds) std::abort();
}

void read_line(std::string_view text) {
  if (const auto entry = groundray::parse_entry(text)) {
    const std::string again = groundray::text_of(*entry);
    const auto read = groundray::parse_entry(again);
    require(read && groundray::text_of(*read) == again);
  }
  if (const auto file = groundray::parse_named_sum(text)) {
    require(groundray::text_of(*file) == text);
  }
}

// No path in the record leads out of the dataset, and all its files are expected there.
void read_record(const fs::path& folder) {
  const groundray::DatasetSummary summary = groundray::read_summary(folder);
  groundray::ExpectedFiles expected(summary);
  groundray::DatasetText text(folder);
  while (const auto line = text.next_entry()) {
    const auto entry = groundray::parse_entry(*line);
    const auto stem = entry ? summary.stem_of(*entry) : std::nullopt;
    if (!stem) continue;
    require(fs::path(*stem).is_relative() && stem->find("..") == std::string::npos);
    if (!entry->is_done || !expected.add(*entry)) continue;
    for (const groundray::ProductSum& file : entry->files)
      require(file.suffix.find('/') == std::string::npos);
  }
  for (const groundray::NamedSum& file : text.files()) {
    const fs::path path(file.path);
    require(path.is_relative() && path.lexically_normal().generic_string() == file.path);
    expected.add(file);
    require(!expected.fault_of(file.path));
  }
}

// No sensor's files lie outside the dataset.
void read_lidars(const fs::path& folder) {
  for (const groundray::RecordedLidar& lidar : groundray::read_dataset(folder).lidars) {
    require(lidar.name.find_first_of("/.") == std::string::npos);
    for (const groundray::RecordedFrame& frame : lidar.frames)
      require(frame.file.lexically_relative(folder).begin()->string() == "lidar");
  }
}

template <typename Read>
void read_or_reject(const Read& read) {
  try {
    read();
  } catch (const groundray::Error&) {
    // Rejected with a message.
  }
}

}  // namespace

/// Any line that is read from the bytes is unchanged after being written and read again. As a whole
/// dataset.yaml or journal, the bytes are read or rejected by an Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  read_line(text);
  const fs::path record = folder.path() / groundray::dataset_file;
  std::ofstream(record, std::ios::binary) << text;
  read_or_reject([] { read_record(folder.path()); });
  read_or_reject([] { read_lidars(folder.path()); });
  read_or_reject([] { groundray::verify(folder.path(), [](const std::string&) {}); });
  groundray::read_journal(record, [](const std::string& entry) { read_line(entry); });
  return 0;
}
