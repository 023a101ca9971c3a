#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/dataset_text.h"
#include "apps/dataset/frame_entry.h"
#include "apps/dataset/run_part.h"
#include "apps/dataset/write/dataset_folder.h"
#include "apps/dataset/write/journal.h"
#include "apps/scene/simulation.h"

namespace groundray {

/// Beginning of the comment in a scan's header that states its convergence; a YAML mapping follows.
inline constexpr std::string_view convergence_comment = "convergence ";

/// Returns the time and trajectory of a frame; sensors are numbered as in dataset.yaml.
Exposed exposed(const Simulation& simulation, std::uint32_t sensor, std::int64_t frame);

/// Output folder of a run (docs/reference/formats.md). Sensors are numbered as in dataset.yaml:
/// lidars, then cameras. One thread may note a frame while another queries other frames.
class DatasetWriter {
 public:
  /// Writes dataset.yaml, poses and calibration. Checks the existing files, and removes temporary
  /// files of an interrupted run.
  /// @param simulation  must outlive this.
  /// @throws Error if the folder cannot be written, another run uses it, or it has contents that
  ///         `use` does not permit; as checked_choice; Interrupted.
  DatasetWriter(std::filesystem::path folder, const Simulation& simulation, FolderUse use,
                RunPart part = {}, FolderMessages messages = {});

  /// Returns the path of a product's file: `suffix` follows the frame's number.
  std::filesystem::path product_path(std::uint32_t sensor, std::int64_t frame,
                                     std::string_view suffix) const;

  /// Returns the number of a sensor's frames in a whole run.
  std::int64_t frames(std::uint32_t sensor) const { return sensors_[sensor].frames; }
  std::uint32_t sensor_count() const { return static_cast<std::uint32_t>(sensors_.size()); }
  /// Returns true if the run has chosen a sensor.
  bool lists(std::uint32_t sensor) const { return part_.choice.has_sensor(sensors_[sensor].name); }
  /// Returns true if a frame is in the part of the run that is made.
  bool includes(std::uint32_t sensor, std::int64_t frame) const;
  /// Returns true if a frame is finished; its files are then exactly as written.
  bool has(std::uint32_t sensor, std::int64_t frame) const;

  /// Records a frame after all its files have been written.
  /// @return size of its files, bytes.
  /// @throws Error if one cannot be read, or the disk is full.
  std::uint64_t note(std::uint32_t sensor, std::int64_t frame);

  /// Faults of the existing files, one sentence each.
  const std::vector<std::string>& faults() const noexcept { return faults_; }

  /// Updates dataset.yaml. No frame may be noted afterwards.
  /// @throws Error if it cannot be written; a resumed run then still knows the frames.
  void close();

 private:
  struct Sensor {
    std::string name;
    std::filesystem::path folder;
    std::vector<std::string> suffixes;  // of a frame's files
    std::int64_t frames = 0;
    std::vector<std::uint64_t> entry_after;  // by frame: 1 + its position in the journal, or 0
  };
  struct Check;

  bool lists_frame(std::uint32_t sensor, std::int64_t frame) const;
  bool is_taken_up(FolderUse use) const;
  void check_part(const DatasetText& before) const;
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
  const Simulation& simulation_;
  RunPart part_;
  FolderMessages messages_;
  std::string header_;  // part of dataset.yaml that describes the run
  std::vector<Sensor> sensors_;
  std::vector<NamedSum> files_;  // files that belong to no frame
  std::vector<std::string> faults_;
  std::optional<FolderLock> lock_;
  std::optional<Journal> journal_;
};

}  // namespace groundray
