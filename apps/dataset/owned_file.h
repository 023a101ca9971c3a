#pragma once

#include <cstdio>
#include <memory>

namespace groundray {

/// Deleter that closes a file of the C library.
struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};

/// File of the C library, closed by its owner's destructor.
using OwnedFile = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace groundray
