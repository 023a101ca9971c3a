#pragma once

// Private to the library: points sorted into bins, in memory and beyond it on disk.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "reconstruction/dem/nameless_file.h"
#include "reconstruction/dem/packed_point.h"

namespace groundray {

/// Takes points bin by bin and gives each bin's back in the order they came in. They are kept in
/// chunks of one bin each: the first in memory, the others in a file.
class PointSpool {
 public:
  /// @param most_bytes  of memory for full chunks; as much again at most for those not yet full,
  ///                    but for 1 KB each.
  /// @param folder      of the file, which is made when memory does not suffice.
  PointSpool(std::size_t bins, std::size_t most_bytes, std::filesystem::path folder);

  /// @throws Error as NamelessFile.
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

  /// Returns all points of a bin, as they lie in memory; those on disk are read to `read_back`.
  std::vector<std::span<const PackedPoint>> parts(std::size_t bin,
                                                  std::vector<PackedPoint>& read_back) const;

  /// Shows a bin's points, a part of them at a time. Any number of threads may read.
  void read(std::size_t bin, const std::function<void(std::span<const PackedPoint>)>& visit) const;

 private:
  using Chunk = std::unique_ptr<PackedPoint[]>;
  struct Bin {
    Chunk open;
    std::size_t fill = 0;
    std::size_t room = 0;
    std::vector<std::uint64_t> chunks;  // numbers of its full ones
  };
  void make_room(Bin& bin);

  std::size_t chunk_points_;
  std::size_t most_in_memory_;  // chunks
  std::filesystem::path folder_;
  std::vector<Bin> bins_;
  std::vector<Chunk> in_memory_;  // the chunks of the lowest numbers
  std::uint64_t on_disk_ = 0;     // how many chunks follow them in the file
  std::unique_ptr<NamelessFile> file_;
};

}  // namespace groundray
