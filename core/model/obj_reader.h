#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "core/model/polygon_soup.h"

namespace groundray {

/// Reads Wavefront OBJ: v, vt, vn, f, usemtl and mtllib; l, p and curved patches are counted. Names
/// of materials and of .mtl files may contain " #": it begins a comment only if the full name does
/// not exist.
/// @param name      file name in error messages.
/// @param read_mtl  returns the text of the named .mtl file, or throws Error if there is none; the
///         line is added to its Errors.
/// @throws Error naming file, line and rule.
/// @see Wavefront, Advanced Visualizer, appendix B1: Object Files (.obj).
PolygonSoup parse_obj(std::string_view text, const std::string& name,
                      const std::function<std::string(const std::string&)>& read_mtl);

}  // namespace groundray
