#include "apps/dataset/write/merge.h"

#include <sys/resource.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "apps/dataset/dataset_reader.h"
#include "apps/dataset/dataset_text.h"
#include "apps/dataset/file_sum.h"
#include "apps/dataset/write/journal.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/open_file.h"
#include "core/progress.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Frame of a run, and the shard that has it.
struct SharedFrame {
  std::size_t shard = 0;  // index in the folders
  std::string text;       // text of its entry
  FrameEntry entry;
};

// Raises the limit of open files if necessary: each shard is open twice, for its lock and for
// reading, and threads open files to read and write.
// @throws Error if the system does not permit it.
void allow_open_files(std::size_t shards) {
  constexpr std::size_t others = 64;
  const auto threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const rlim_t needed = 2 * shards + 2 * threads + others;
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= needed) return;
  const rlim_t allowed = limit.rlim_max;
  limit.rlim_cur = needed;
  if (allowed >= needed && setrlimit(RLIMIT_NOFILE, &limit) == 0) return;
  throw Error(
      "{} shards need {} open files at a time, but the system allows {}; raise the limit by "
      "`ulimit -Hn`, or ask its administrator",
      shards, needed, allowed);
}

// Reads the dataset.yaml files of all shards in step.
class ShardTexts {
 public:
  // @param folders, summary  must outlive this; the summary may be that of any shard.
  ShardTexts(const std::vector<fs::path>& folders, const DatasetSummary& summary)
      : folders_(folders), summary_(summary) {
    for (const fs::path& folder : folders) texts_.push_back(std::make_unique<DatasetText>(folder));
    skip_finished_sensors();
  }

  const std::string& header() const { return texts_[0]->header(); }
  const std::vector<NamedSum>& files() const { return texts_[0]->files(); }

  // @throws Error unless the folders are all shards of one run.
  void check_shards() const {
    std::vector<std::optional<fs::path>> found;
    for (std::size_t i = 0; i < texts_.size(); ++i) {
      const DatasetText& text = *texts_[i];
      const std::string name = folders_[i].string();
      if (!text.shard())
        throw Error("{}: the dataset {}, not a shard", name,
                    text_of(text.choice()).empty() ? "is complete" : "has chosen frames");
      if (text.header() != header()) {
        throw Error("{}: it belongs to another run than {}: {}", name, folders_[0].string(),
                    first_difference(text.header(), header()));
      }
      if (fs::exists(folders_[i] / journal_file)) throw_incomplete(i);
      found.resize(texts_[0]->shard()->count);
      if (text.shard()->count != found.size()) {
        throw Error("{}: it is shard {}, but {} is {}: all shards must have the same N", name,
                    text_of(*text.shard()), folders_[0].string(), text_of(*texts_[0]->shard()));
      }
      auto& place = found[text.shard()->index - 1];
      if (place)
        throw Error("{}: shard {} is given twice: also in {}", name, text_of(*text.shard()),
                    place->string());
      place = folders_[i];
    }
    const auto missing = std::ranges::find_if(found, [](const auto& place) { return !place; });
    if (missing == found.end()) return;
    throw Error(
        "shard {}/{} is missing; create it with `groundray generate --shard`, or add its folder",
        missing - found.begin() + 1, found.size());
  }

  // Returns the next frame; nothing after the last one.
  // @throws Error if no shard or two shards have it.
  std::optional<SharedFrame> next() {
    std::optional<SharedFrame> frame;
    std::size_t ended = 0;
    for (std::size_t i = 0; i < texts_.size(); ++i) {
      const auto text = texts_[i]->next_entry();
      if (!text) {
        ++ended;
        continue;
      }
      auto entry = parse_entry(*text);
      const bool is_same = entry && entry->sensor == sensor_name() && entry->frame == frame_;
      if (!is_same) throw_broken(i);
      if (!entry->is_done) continue;
      if (frame || entry->files.empty()) throw_broken(i);
      frame = SharedFrame{i, *text, std::move(*entry)};
    }
    if (ended == texts_.size()) {
      check_ends();
      return std::nullopt;
    }
    if (ended > 0) throw_broken(0);
    if (!frame) throw_incomplete(owner());
    ++frame_;
    skip_finished_sensors();
    return frame;
  }

 private:
  std::string_view sensor_name() const {
    return sensor_ < summary_.sensors.size() ? summary_.sensors[sensor_].name : std::string_view();
  }
  void skip_finished_sensors() {
    while (sensor_ < summary_.sensors.size() && frame_ >= summary_.sensors[sensor_].frames) {
      ++sensor_;
      frame_ = 0;
    }
  }

  // Returns the index of the folder that should have the frame.
  std::size_t owner() const {
    const auto it = std::ranges::find_if(texts_, [&](const auto& text) {
      return text->shard()->has(static_cast<std::uint32_t>(sensor_), frame_,
                                summary_.sensors[sensor_].frames);
    });
    return static_cast<std::size_t>(it - texts_.begin());
  }

  void check_ends() const {
    if (sensor_ < summary_.sensors.size()) throw_broken(0);
    for (std::size_t i = 0; i < texts_.size(); ++i) {
      const auto same = [](const NamedSum& a, const NamedSum& b) {
        return a.path == b.path && a.sum == b.sum;
      };
      if (!texts_[i]->is_intact() || !std::ranges::equal(texts_[i]->files(), files(), same))
        throw_broken(i);
    }
  }

  [[noreturn]] void throw_incomplete(std::size_t i) const {
    throw Error("{}: shard {} is not complete; continue it with `groundray generate --resume`",
                folders_[i].string(), text_of(*texts_[i]->shard()));
  }
  [[noreturn]] void throw_broken(std::size_t i) const {
    throw Error("{}: changed since it was written; `groundray verify` reports details",
                (folders_[i] / dataset_file).string());
  }

  const std::vector<fs::path>& folders_;
  const DatasetSummary& summary_;
  std::vector<std::unique_ptr<DatasetText>> texts_;
  std::size_t sensor_ = 0;  // of the next frame
  std::int64_t frame_ = 0;
};

// Common properties of the shards of a run.
struct Joined {
  DatasetSummary summary;  // of any shard
  std::string header;
  std::vector<NamedSum> files;  // files that belong to no frame; every shard has them
  std::uint64_t frames = 0;
};

// @throws Error unless these are all shards of one run, each given once and complete.
Joined check_shards(const std::vector<fs::path>& shards) {
  Joined joined{.summary = read_summary(shards[0]), .header = {}, .files = {}};
  ShardTexts texts(shards, joined.summary);
  texts.check_shards();
  while (texts.next()) {
    stop_if_interrupted();
    ++joined.frames;
  }
  joined.header = texts.header();
  joined.files = texts.files();
  return joined;
}

// File to be copied from a shard to the merged dataset.
struct Copy {
  fs::path from, to;
  FileSum sum;
};

// @throws Error if the file is not as its shard states.
void copy_file(const Copy& copy) {
  std::ifstream file = open_stream(copy.from);
  if (const int fault = errno; !file && fault != ENOENT) {
    throw Error("{}: {}; `groundray verify` lists all such files", copy.from.string(),
                why_not_read(copy.from, fault));
  }
  std::vector<char> block(256 << 10);
  Sha256 sum;
  write_blocks(copy.to, [&]() -> std::string_view {
    stop_if_interrupted();
    file.read(block.data(), static_cast<std::streamsize>(block.size()));
    const std::string_view read(block.data(), static_cast<std::size_t>(file.gcount()));
    sum.add(read);
    if (read.empty() && sum.digits() != copy.sum.sha256) {
      throw Error(
          "{}: missing or changed since it was written; `groundray verify` lists all such files",
          copy.from.string());
    }
    return read;
  });
}

void copy_all(std::span<const Copy> copies, FolderUse use) {
  tbb::parallel_for(std::size_t{0}, copies.size(), [&](std::size_t i) {
    stop_if_interrupted();
    const Copy& copy = copies[i];
    if (use == FolderUse::Resume && !fault_of(copy.to, copy.sum)) return;
    copy_file(copy);
  });
}

void check_out(const fs::path& out, FolderUse use, const std::string& header) {
  if (is_as_new(out)) return;
  if (use == FolderUse::New)
    throw Error(
        "{}: the folder is not empty; choose a new one with -o{}", out.string(),
        fs::exists(out / dataset_file) ? ", or continue a merge into it with --resume" : "");
  const DatasetText before(out);
  if (before.header() != header || before.shard() || !text_of(before.choice()).empty())
    throw Error("{}: the folder contains another dataset; choose a new one with -o", out.string());
}

// Writes dataset.yaml with the text that `text_for` returns for each frame, provided that the
// shards have every frame.
void write_joined(const std::vector<fs::path>& shards, const Joined& joined, const fs::path& out,
                  const std::function<std::string(SharedFrame&)>& text_for) {
  ShardTexts texts(shards, joined.summary);
  const auto next = [&]() -> std::optional<std::string> {
    auto frame = texts.next();
    return frame ? std::optional(text_for(*frame)) : std::nullopt;
  };
  write_dataset_text(out, joined.header, {}, next, joined.files);
}

std::string pending_text(const SharedFrame& frame) {
  const FrameEntry& entry = frame.entry;
  return text_of(FrameEntry{.sensor = entry.sensor, .frame = entry.frame, .stamp = entry.stamp});
}

// Returns the number of bytes that were copied or already in the folder.
std::uint64_t copy_shards(const std::vector<fs::path>& shards, const Joined& joined,
                          const fs::path& out, FolderUse use, std::FILE* shown) {
  constexpr std::size_t block = 256;  // number of files at a time
  ShardTexts texts(shards, joined.summary);
  std::vector<Copy> copies;
  std::uint64_t bytes = 0, frames = 0;
  Progress progress(shown, "frames merged", joined.frames);
  const auto add = [&](std::size_t shard, const std::string& path, const FileSum& sum) {
    copies.push_back({shards[shard] / path, out / path, sum});
    bytes += sum.bytes;
    if (copies.size() < block) return;
    copy_all(copies, use);
    copies.clear();
    progress.update(frames);
  };
  for (const DatasetSummary::Sensor& sensor : joined.summary.sensors)
    make_folder(out / sensor.kind / sensor.name);
  for (const char* name : {"poses", "calibration"}) make_folder(out / name);
  for (const NamedSum& file : joined.files) add(0, file.path, file.sum);
  while (const auto frame = texts.next()) {
    ++frames;
    const auto stem = joined.summary.stem_of(frame->entry);
    for (const ProductSum& file : frame->entry.files)
      add(frame->shard, *stem + file.suffix, file.sum);
  }
  copy_all(copies, use);
  return bytes;
}

}  // namespace

Merged merge(const std::vector<fs::path>& shards, const fs::path& out, FolderUse use,
             const FolderMessages& messages) {
  allow_open_files(shards.size());
  std::vector<std::unique_ptr<FolderLock>> locks;
  for (const fs::path& shard : shards)
    locks.push_back(std::make_unique<FolderLock>(shard, FolderLock::Use::Read));
  const Joined joined = check_shards(shards);
  std::error_code ignored;
  for (const fs::path& shard : shards) {
    if (fs::equivalent(shard, out, ignored))
      throw Error("{}: it is one of the shards; choose a new folder with -o", out.string());
  }
  make_folder(out);
  const FolderLock lock(out, FolderLock::Use::Write, messages.warn);
  check_out(out, use, joined.header);
  write_joined(shards, joined, out, pending_text);
  const std::uint64_t bytes = copy_shards(shards, joined, out, use, messages.progress);
  write_joined(shards, joined, out, [](SharedFrame& frame) { return std::move(frame.text); });
  fs::remove(out / journal_file, ignored);
  return {joined.frames, bytes};
}

}  // namespace groundray
