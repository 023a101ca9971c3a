#pragma once

#include <string>

#include "apps/scene/yaml_reader.h"

namespace groundray::yaml {

/// Returns the text of a document, which parse() reads to an equal tree; comments are not kept.
/// Lists of scalars are in one line.
std::string text_of(const Node& node);

/// Returns the text of a value in one line.
std::string line_of(const Node& node);

}  // namespace groundray::yaml
