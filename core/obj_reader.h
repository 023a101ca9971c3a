#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "core/polygon_soup.h"

namespace groundray {

/// Reads Wavefront OBJ: v, vt, vn, f, usemtl and mtllib; l, p and curved patches are counted. Names
/// of materials and of .mtl files may have " #" within: it begins a comment where there is nothing
/// of the whole name.
/// @param name      stands for the file in messages.
/// @param read_mtl  returns the text of the .mtl of that name, or throws Error if there is none;
///                  its Errors are given the line.
/// @throws Error naming file, line and rule.
/// @see Wavefront, Advanced Visualizer, appendix B1: Object Files (.obj).
PolygonSoup parse_obj(std::string_view text, const std::string& name,
                      const std::function<std::string(const std::string&)>& read_mtl);

}  // namespace groundray
