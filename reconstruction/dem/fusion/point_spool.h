#pragma once

// Private to the library: points sorted into bins, in memory and, beyond it, on disk.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "reconstruction/dem/fusion/packed_point.h"

namespace groundray {

/// Temporary file without a name: it disappears with the object, or with the process however that
/// ends.
class TemporaryFile {
 public:
  /// @throws Error naming the folder if no file can be created there.
  explicit TemporaryFile(const std::filesystem::path& folder);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Writes bytes at an offset. @throws Error naming the folder if the system does not accept them.
  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Reads bytes; any number of threads may call it. @throws Error naming the folder if bytes are
  /// missing.
  void read(std::uint64_t offset, std::span<std::byte> bytes) const;

 private:
  std::filesystem::path folder_;
  int file_ = -1;
};

/// Store of points by bin, which returns the points of each bin in their order of arrival. Points
/// are kept in chunks of one bin each: the first in memory, the others in a temporary file.
class PointSpool {
 public:
  /// @param most_bytes  memory for full chunks; those that are not yet full take as much again at
  ///        most, or 1 KB per bin if that is more.
  /// @param folder  folder of the file, which is created when memory does not suffice.
  PointSpool(std::size_t bins, std::size_t most_bytes, std::filesystem::path folder);

  /// Adds a point. @throws Error as TemporaryFile.
  void add(std::size_t bin, const PackedPoint& point) {
    Bin& to = bins_[bin];
    if (to.fill == to.room) make_room(to);
    to.open[to.fill++] = point;
  }
  std::uint64_t count(std::size_t bin) const noexcept {
    return bins_[bin].chunks.size() * chunk_points_ + bins_[bin].fill;
  }
  std::size_t bins() const noexcept { return bins_.size(); }
  std::uint64_t bytes_on_disk() const noexcept;

  /// Returns all points of a bin, in memory where they are; those on disk are read into
  /// `read_back`.
  std::vector<std::span<const PackedPoint>> parts(std::size_t bin,
                                                  std::vector<PackedPoint>& read_back) const;

  /// Passes a bin's points to `visit`, a part of them at a time. Any number of threads may read.
  void read(std::size_t bin, const std::function<void(std::span<const PackedPoint>)>& visit) const;

 private:
  using Chunk = std::unique_ptr<PackedPoint[]>;
  struct Bin {
    Chunk open;
    std::size_t fill = 0;
    std::size_t room = 0;
    std::vector<std::uint64_t> chunks;  // numbers of its full chunks
  };
  void make_room(Bin& bin);

  std::size_t chunk_points_;
  std::size_t most_in_memory_;  // in chunks
  std::filesystem::path folder_;
  std::vector<Bin> bins_;
  std::vector<Chunk> in_memory_;  // chunks with the lowest numbers
  std::uint64_t on_disk_ = 0;     // number of chunks after them in the file
  std::unique_ptr<TemporaryFile> file_;
};

}  // namespace groundray
