#include "reconstruction/dem/fusion/point_spool.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>

#include "core/error.h"

namespace groundray {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& folder, int fault) {
  const char* const way = fault == ENOSPC   ? "free some space"
                          : fault == EDQUOT ? "raise the quota"
                          : fault == EFBIG  ? "raise the limit on file sizes (ulimit -f)"
                          : fault == ENOENT ? "create the folder first"
                                            : "check that it is writable";
  throw Error(
      "points that do not fit into memory cannot be stored in the folder {}: {}; {}, choose "
      "another folder, or allow more memory",
      folder.string(), std::generic_category().message(fault), way);
}

}  // namespace

TemporaryFile::TemporaryFile(const std::filesystem::path& folder) : folder_(folder) {
  std::string name = (folder / "groundray_points_XXXXXX").string();
  file_ = mkstemp(name.data());
  if (file_ < 0) refuse(folder, errno);
  unlink(name.c_str());
}

TemporaryFile::~TemporaryFile() { close(file_); }

void TemporaryFile::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) refuse(folder_, done < 0 ? errno : ENOSPC);
    offset += static_cast<std::uint64_t>(done);
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
}

void TemporaryFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t done = pread(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      throw Error("points stored in the folder {} cannot be read back: {}; check the disk",
                  folder_.string(),
                  done < 0 ? std::generic_category().message(errno) : "the file is too short");
    }
    offset += static_cast<std::uint64_t>(done);
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
}

PointSpool::PointSpool(std::size_t bins, std::size_t most_bytes, std::filesystem::path folder)
    : folder_(std::move(folder)), bins_(bins) {
  constexpr std::size_t least = 42, most = 2730;  // points in 1 KB and in 64 KB
  chunk_points_ =
      std::clamp(most_bytes / (std::max<std::size_t>(bins, 1) * sizeof(PackedPoint)), least, most);
  most_in_memory_ = most_bytes / (chunk_points_ * sizeof(PackedPoint));
}

std::uint64_t PointSpool::bytes_on_disk() const noexcept {
  return on_disk_ * chunk_points_ * sizeof(PackedPoint);
}

// The first chunk of a bin grows by doubling, so that many bins of few points stay small.
void PointSpool::make_room(Bin& bin) {
  if (bin.room < chunk_points_) {
    const std::size_t room = std::clamp<std::size_t>(2 * bin.room, 16, chunk_points_);
    auto larger = std::make_unique_for_overwrite<PackedPoint[]>(room);
    std::copy_n(bin.open.get(), bin.fill, larger.get());
    bin.open = std::move(larger);
    bin.room = room;
    return;
  }
  bin.fill = 0;
  bin.chunks.push_back(in_memory_.size() + on_disk_);
  if (in_memory_.size() < most_in_memory_) {
    in_memory_.push_back(std::move(bin.open));
    bin.open = std::make_unique_for_overwrite<PackedPoint[]>(chunk_points_);
    return;
  }
  if (!file_) file_ = std::make_unique<TemporaryFile>(folder_);
  file_->write(bytes_on_disk(), std::as_bytes(std::span(bin.open.get(), chunk_points_)));
  ++on_disk_;
}

std::vector<std::span<const PackedPoint>> PointSpool::parts(
    std::size_t bin, std::vector<PackedPoint>& read_back) const {
  const Bin& from = bins_[bin];
  std::size_t on_disk = 0;
  for (const std::uint64_t chunk : from.chunks) on_disk += chunk < in_memory_.size() ? 0 : 1;
  read_back.resize(on_disk * chunk_points_);
  std::vector<std::span<const PackedPoint>> found;
  found.reserve(from.chunks.size() + 1);
  std::span<PackedPoint> room(read_back);
  for (const std::uint64_t chunk : from.chunks) {
    if (chunk < in_memory_.size()) {
      found.emplace_back(in_memory_[chunk].get(), chunk_points_);
      continue;
    }
    const std::span<PackedPoint> part = room.first(chunk_points_);
    room = room.subspan(chunk_points_);
    file_->read((chunk - in_memory_.size()) * chunk_points_ * sizeof(PackedPoint),
                std::as_writable_bytes(part));
    found.emplace_back(part);
  }
  if (from.fill > 0) found.emplace_back(from.open.get(), from.fill);
  return found;
}

void PointSpool::read(std::size_t bin,
                      const std::function<void(std::span<const PackedPoint>)>& visit) const {
  const Bin& from = bins_[bin];
  std::vector<PackedPoint> read_back;
  for (const std::uint64_t chunk : from.chunks) {
    if (chunk < in_memory_.size()) {
      visit({in_memory_[chunk].get(), chunk_points_});
      continue;
    }
    read_back.resize(chunk_points_);
    file_->read((chunk - in_memory_.size()) * chunk_points_ * sizeof(PackedPoint),
                std::as_writable_bytes(std::span(read_back)));
    visit(read_back);
  }
  if (from.fill > 0) visit({from.open.get(), from.fill});
}

}  // namespace groundray
