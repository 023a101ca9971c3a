#pragma once

#include <cstdio>
#include <memory>

namespace groundray {

/// Closes a file of the C library, whatever becomes of it.
struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};

/// A file of the C library that is closed with its owner.
using OwnedFile = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace groundray
