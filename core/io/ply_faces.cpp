#include "core/io/ply_faces.h"

#include <fstream>
#include <string>

#include "core/io/open_file.h"

namespace groundray {

bool has_faces(const std::filesystem::path& ply) {
  constexpr int most_lines = 1000;
  std::ifstream file = open_stream(ply);
  std::string line;
  for (int i = 0; i < most_lines && next_line(file, line); ++i) {
    if (line.starts_with("end_header")) break;
    if (line.starts_with("element face") || line.starts_with("element tristrips"))
      return line.find_first_of("123456789", 12) != std::string::npos;
  }
  return false;
}

}  // namespace groundray
