#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "apps/scene/yaml_reader.h"

namespace groundray::sampling {

/// Path to a value of a scene: keys, with the names of list items or their numbers from 0.
using KeyPath = std::vector<std::string>;

/// Splits `sky.sun.elevation_deg` at its points.
KeyPath parse_key_path(std::string_view text);

/// Returns the value at a path; null if there is none.
const yaml::Node* find(const yaml::Node& root, const KeyPath& path);

/// Returns the first part of a path at which a value cannot be set, because there is no such part
/// in the scene; empty if it can be set. The last part need not exist in a map.
std::string first_missing(const yaml::Node& root, const KeyPath& path);

/// Sets the value at a path, for which first_missing() is empty.
void set(yaml::Node& root, const KeyPath& path, const yaml::Node& value);

/// Removes what is at each of some paths that find() finds; numbers of list items are those before.
void remove(yaml::Node& root, const std::vector<KeyPath>& paths);

/// Returns true if the paths are equal, or one leads to a part of what is at the other.
bool overlap(const KeyPath& a, const KeyPath& b);

}  // namespace groundray::sampling
