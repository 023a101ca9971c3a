#pragma once

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/error.h"

/// Values of a glTF file's JSON. The functions throw Error, with the name of the value and what it
/// must be. Entries must be objects.
namespace groundray {

using nlohmann::json;

/// Returns a number of an entry, or `absent` if the entry has none.
inline double json_number(const json& entry, const char* key, std::optional<double> absent = {}) {
  const auto found = entry.find(key);
  if (found == entry.end() && absent) return *absent;
  if (found == entry.end()) throw Error("{} is missing", key);
  if (!found->is_number())
    throw Error("{} must be a number, but its type is {}", key, found->type_name());
  return found->get<double>();
}

/// Returns an index, a count or an enumerator, which may be written as 1.0.
inline std::size_t json_whole(double value, const char* key) {
  if (!(value >= 0 && value < 0x1p53 && value == std::floor(value)))
    throw Error("{} = {} must be a whole number", key, value);
  return static_cast<std::size_t>(value);
}

/// Returns a whole number of an entry, or `absent` if the entry has none.
inline std::size_t json_whole(const json& entry, const char* key,
                              std::optional<double> absent = {}) {
  return json_whole(json_number(entry, key, absent), key);
}

/// Returns a text of an entry; an empty one if the entry has none.
inline std::string json_text(const json& entry, const char* key) {
  const auto found = entry.find(key);
  if (found == entry.end()) return {};
  if (!found->is_string())
    throw Error("{} must be a text, but its type is {}", key, found->type_name());
  return found->get<std::string>();
}

/// Returns a list of an entry; an empty one if the entry has none.
inline const json& json_list(const json& entry, const char* key) {
  static const json none = json::array();
  const auto found = entry.find(key);
  if (found == entry.end()) return none;
  if (!found->is_array())
    throw Error("{} must be a list, but its type is {}", key, found->type_name());
  return *found;
}

/// Returns an object of an entry.
inline const json& json_object(const json& entry, const char* key) {
  const auto found = entry.find(key);
  if (found == entry.end()) throw Error("{} is missing", key);
  if (!found->is_object()) throw Error("{} must be an object", key);
  return *found;
}

/// Calls visit(object) for each object of a list; faults are named by list and number.
void for_each_in(auto& entry, const char* key, const auto& visit) {
  if (json_list(entry, key).empty()) return;
  std::size_t at = 0;
  for (auto& object : *entry.find(key)) {
    try {
      if (!object.is_object())
        throw Error("must be an object, but its type is {}", object.type_name());
      visit(object);
    } catch (const Error& fault) {
      throw Error("{}[{}]: {}", key, at, fault.what());
    }
    ++at;
  }
}

/// Returns the object of the file's list `key` with this index.
inline const json& referred(const json& gltf, const char* key, std::size_t index) {
  const json& entries = json_list(gltf, key);
  if (index >= entries.size()) throw Error("there is no {}[{}]", key, index);
  if (!entries[index].is_object()) throw Error("{}[{}] must be an object", key, index);
  return entries[index];
}

/// Removes what groundray does not use, so that assimp does not read it: animations, skins,
/// cameras, extensions and others.
void strip_gltf(json& gltf);

}  // namespace groundray
