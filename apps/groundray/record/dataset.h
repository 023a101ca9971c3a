#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/frame_entry.h"
#include "apps/dataset/shard.h"
#include "apps/groundray/run/folder_lock.h"
#include "apps/groundray/run/journal.h"
#include "apps/scene/world.h"

namespace groundray {

/// What the comment of a scan with its convergence begins with; a YAML mapping follows.
inline constexpr std::string_view convergence_comment = "convergence ";

/// What a run may find in its folder: nothing, or also what an earlier one of the same scene, seed,
/// version and shard has made, which is then kept as far as it is sound.
enum class FolderUse { New, Resume };

/// Whether a folder is empty, or holds no more than a run or a merge leaves that was cut off before
/// it had written anything. @throws std::filesystem::filesystem_error if it cannot be read.
bool is_as_new(const std::filesystem::path& folder);

/// The folder that a run fills (docs/formats.md). Sensors are numbered as in dataset.yaml: lidars,
/// then cameras. Frames may be noted by another thread than the one that asks for others.
class Dataset {
 public:
  /// Writes dataset.yaml, poses and calibration. What is there is read through, and what a run that
  /// was cut off has left half-written is removed.
  /// @param world  is to outlive this.
  /// @throws Error if the folder cannot be written, another run is at work in it, or it holds
  /// anything that `use` does not allow; Interrupted.
  Dataset(std::filesystem::path folder, const World& world, FolderUse use,
          std::optional<Shard> shard = std::nullopt);

  /// Returns the file of a product: `suffix` follows the frame's number.
  std::filesystem::path product_path(std::uint32_t sensor, std::int64_t frame,
                                     std::string_view suffix) const;

  /// How many frames a sensor has in a whole run.
  std::int64_t frames(std::uint32_t sensor) const { return sensors_[sensor].frames; }
  std::uint32_t sensor_count() const { return static_cast<std::uint32_t>(sensors_.size()); }
  /// Whether a frame is there, to the bit.
  bool has(std::uint32_t sensor, std::int64_t frame) const;

  /// Takes a frame, all of whose files have been written, into the dataset.
  /// @return their size in bytes. @throws Error if one cannot be read, or the disk is full.
  std::uint64_t note(std::uint32_t sensor, std::int64_t frame);

  /// What was found wrong with what was there, a sentence each.
  const std::vector<std::string>& faults() const noexcept { return faults_; }

  /// Brings dataset.yaml up to date. Nothing may be noted after that.
  /// @throws Error if it cannot be written; all frames are then known yet to who resumes.
  void close();

 private:
  struct Sensor {
    std::string name;
    std::filesystem::path folder;
    std::vector<std::string> suffixes;  // of a frame's files
    std::int64_t frames = 0;
    std::vector<std::uint64_t> entry_after;  // by frame: 1 + its entry's place in the journal, or 0
  };
  struct Check;

  bool is_taken_up(FolderUse use) const;
  void take_up();
  void take_entries(Journal& journal);
  void check_entries(Journal& journal);
  void check(Check& check) const;
  void write_sensors();
  FrameEntry entry_of(std::uint32_t sensor, std::int64_t frame) const;
  std::string done_text(std::uint32_t sensor, std::int64_t frame,
                        std::vector<ProductSum> files) const;
  void write_record() const;

  std::filesystem::path folder_;
  const World& world_;
  std::optional<Shard> shard_;
  std::string header_;  // what dataset.yaml says of the run itself
  std::vector<Sensor> sensors_;
  std::vector<NamedSum> files_;  // that are of no frame
  std::vector<std::string> faults_;
  std::optional<FolderLock> lock_;
  std::optional<Journal> journal_;
};

}  // namespace groundray
