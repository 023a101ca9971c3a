#include "apps/dataset/dataset_text.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <system_error>
#include <utility>

#include "apps/dataset/file_sum.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/open_file.h"
#include "core/near_names.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view frames_line = "frames:", files_line = "files:";
constexpr std::string_view item = "  - ";
constexpr std::string_view shard_begin = "shard: \"", choice_begin = "chosen: \"",
                           sum_key = "sha256_above:", sum_begin = "sha256_above: \"", quote = "\"";

// Writes lines to a file and computes their checksum.
class LineSink {
 public:
  explicit LineSink(const fs::path& path) : file_(fdopen(create_file(path), "wb")) {}

  void write(std::string_view text) {
    sum_.add(text);
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) fail();
  }
  std::string digits() const { return sum_.digits(); }

  void close() {
    if (std::fflush(file_.get()) != 0 || fdatasync(fileno(file_.get())) != 0) fail();
    if (std::fclose(file_.release()) != 0) fail();
  }

 private:
  [[noreturn]] static void fail() { throw std::system_error(errno, std::generic_category()); }

  OwnedFile file_;
  Sha256 sum_;
};

// Waits until the names in a folder are on the disk: synchronising a file does not write its name.
// Some file systems cannot do this, which is ignored.
void sync_folder(const fs::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool is_done = descriptor >= 0 && fsync(descriptor) == 0;
  const int fault = errno;
  if (descriptor >= 0) close(descriptor);
  if (is_done || fault == EINVAL || fault == ENOTSUP || fault == EACCES) return;
  throw Error("{}: cannot be written: {}; check the disk", folder.string(),
              std::generic_category().message(fault));
}

// Returns the text between `begin` and `end`; nothing if the text has another form.
std::optional<std::string_view> between(std::string_view text, std::string_view begin,
                                        std::string_view end) {
  if (text.size() < begin.size() + end.size() || !text.starts_with(begin) || !text.ends_with(end))
    return std::nullopt;
  return text.substr(begin.size(), text.size() - begin.size() - end.size());
}

constexpr std::size_t most_header_bytes = 1 << 26;

}  // namespace

DatasetText::DatasetText(const fs::path& folder)
    : path_(folder / dataset_file), file_(open_stream(path_)) {
  if (!file_) {
    const int why = errno;
    std::error_code ignored;
    if (fs::status(folder, ignored).type() == fs::file_type::not_found)
      throw Error("{}: {}", folder.string(), why_no_file(folder));
    if (fs::is_regular_file(folder, ignored))
      throw Error(
          "{}: a file, but a dataset is a folder: give the folder that `groundray generate` "
          "wrote",
          folder.string());
    if (why != ENOENT) throw Error("{}: {}", path_.string(), why_not_read(path_, why));
    throw Error("{}: the folder contains no {}: was it written by `groundray generate`?",
                folder.string(), dataset_file);
  }
  while (const auto line = next_line()) {
    sum_.add(*line + "\n");
    if (*line == frames_line) return;
    if (!read_part(*line)) header_ += *line + "\n";
    if (header_.size() > most_header_bytes) {
      throw Error("{}: more than {} bytes precede the frames: is it a dataset's?", path_.string(),
                  most_header_bytes);
    }
  }
  throw Error("{}: no frames are listed: it was truncated, or groundray did not write it",
              path_.string());
}

// Reads the line of a shard or of a choice; returns false for any other line.
bool DatasetText::read_part(std::string_view line) {
  if (const auto text = between(line, shard_begin, quote)) {
    part_.shard = parse_shard(*text);
    return part_.shard.has_value();
  }
  const auto text = between(line, choice_begin, quote);
  const auto choice = text ? parse_choice(*text) : std::nullopt;
  if (choice) part_.choice = *choice;
  return choice.has_value();
}

std::optional<std::string> DatasetText::next_line() {
  std::string line;
  if (!groundray::next_line(file_, line)) {
    if (file_.bad()) throw Error("{}: cannot be read: check the disk", path_.string());
    return std::nullopt;
  }
  ++line_;
  return line;
}

std::optional<std::string> DatasetText::next_entry() {
  if (!is_in_frames_) return std::nullopt;
  auto line = next_line();
  if (line && *line != files_line && !line->starts_with(sum_key)) {
    sum_.add(*line + "\n");
    return line->starts_with(item) ? line->substr(item.size()) : std::move(*line);
  }
  is_in_frames_ = false;
  if (line) read_end(std::move(*line));
  return std::nullopt;
}

void DatasetText::read_end(std::string line) {
  bool is_understood = true;
  do {
    if (const auto digits = between(line, sum_begin, quote)) {
      // Intact only if this is the last line, and complete.
      is_intact_ = is_understood && *digits == sum_.digits() && !file_.eof() && !next_line();
      return;
    }
    sum_.add(line + "\n");
    if (!line.starts_with(item)) continue;
    auto file = parse_named_sum(std::string_view(line).substr(item.size()));
    is_understood = is_understood && file;
    if (file) files_.push_back(std::move(*file));
  } while (groundray::next_line(file_, line));
}

std::string first_difference(std::string_view text, std::string_view other) {
  constexpr std::size_t before = 40, most = 80;  // numbers of characters shown
  const auto at = static_cast<std::size_t>(std::ranges::mismatch(text, other).in1 - text.begin());
  const auto part = [at](std::string_view whole) {
    const std::size_t line = at == 0 ? 0 : whole.rfind('\n', at - 1) + 1;  // npos + 1 is 0
    const std::string_view rest = whole.substr(std::max(line, at < before ? 0 : at - before));
    return rest.substr(0, rest.find('\n')).substr(0, most);
  };
  return fmt::format("'{}' instead of '{}'", part(text), part(other));
}

void write_dataset_text(const fs::path& folder, std::string_view header, const RunPart& part,
                        const std::function<std::optional<std::string>()>& next_entry,
                        const std::vector<NamedSum>& files) {
  write_whole(folder / dataset_file, [&](const fs::path& aside) {
    LineSink sink(aside);
    sink.write(header);
    if (part.shard) sink.write(fmt::format("{}{}{}\n", shard_begin, text_of(*part.shard), quote));
    if (const std::string text = text_of(part.choice); !text.empty())
      sink.write(fmt::format("{}{}{}\n", choice_begin, text, quote));
    sink.write(fmt::format("{}\n", frames_line));
    while (const auto entry = next_entry()) sink.write(fmt::format("{}{}\n", item, *entry));
    if (!files.empty()) sink.write(fmt::format("{}\n", files_line));
    for (const NamedSum& file : files) sink.write(fmt::format("{}{}\n", item, text_of(file)));
    sink.write(fmt::format("{}{}{}\n", sum_begin, sink.digits(), quote));
    sink.close();
  });
  sync_folder(folder);
}

}  // namespace groundray
