#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/file_sum.h"

namespace groundray {

/// Checksum of a file of a frame.
struct ProductSum {
  std::string suffix;  ///< end of its name, after the frame's number
  FileSum sum;
};

/// Entry of a frame in dataset.yaml (docs/reference/formats.md).
struct FrameEntry {
  std::string sensor = {};
  std::int64_t frame = 0;
  std::chrono::nanoseconds stamp{0};
  bool is_done = false;
  std::string convergence = {};        ///< of a scan: YAML mapping, or empty
  std::string exposure = {};           ///< of an image: YAML mapping, or empty
  std::vector<ProductSum> files = {};  ///< empty unless the frame is finished
};

/// Returns a time in seconds with nine decimals, exactly.
std::string seconds_text(std::chrono::nanoseconds time);

/// Returns the entry as one line of YAML, without the marker of a list item.
std::string text_of(const FrameEntry& entry);

/// Parses an entry; returns nothing if it is not as text_of writes it. The returned names consist
/// of letters, digits, '_' and '-'; suffixes may also contain '.'.
std::optional<FrameEntry> parse_entry(std::string_view text);

/// Checksum of a file that belongs to no frame.
struct NamedSum {
  std::string path;  ///< relative to the dataset, with slashes
  FileSum sum;
};
/// Returns the entry as one line of YAML, as for a frame.
std::string text_of(const NamedSum& file);
/// Parses the entry of such a file; returns nothing if it is not as text_of writes it.
std::optional<NamedSum> parse_named_sum(std::string_view text);

}  // namespace groundray
