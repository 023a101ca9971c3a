#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/file_sum.h"

namespace groundray {

/// A file of a frame.
struct ProductSum {
  std::string suffix;  ///< of its name, after the frame's number
  FileSum sum;
};

/// What dataset.yaml says of a frame (docs/formats.md).
struct FrameEntry {
  std::string sensor;
  std::int64_t frame = 0;
  std::chrono::nanoseconds stamp{0};
  bool is_done = false;
  std::string convergence;        ///< a YAML mapping; empty if there is none
  std::vector<ProductSum> files;  ///< of a frame that is done
};

/// Returns the entry as one line of YAML, without what makes it an item of a list.
std::string text_of(const FrameEntry& entry);

/// Returns the entry that such a line stands for: nothing, if it is not as text_of writes it. Names
/// that it returns are of letters, digits, '_', '-' and, of suffixes, '.'.
std::optional<FrameEntry> parse_entry(std::string_view text);

/// A file that belongs to no frame.
struct NamedSum {
  std::string path;  ///< in the dataset, with slashes
  FileSum sum;
};
std::string text_of(const NamedSum& file);
std::optional<NamedSum> parse_named_sum(std::string_view text);

}  // namespace groundray
