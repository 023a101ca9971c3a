#pragma once

#include <string>

#include "apps/scan/command_text.h"

namespace groundray {

/// Returns the manual page of a program, section 1, for `man`. Equal programs give equal bytes: it
/// has no date.
/// @param version  as the program prints it: "groundray 0.1.0".
/// @param notes    text at the end of the program's help.
/// @see man-pages(7), the sections of a page.
std::string man_page(const CommandText& program, const std::string& version,
                     const std::string& notes);

}  // namespace groundray
