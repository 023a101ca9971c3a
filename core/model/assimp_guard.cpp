#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/json_fault.h"
#include "core/io/memory.h"
#include "core/model/gltf_json.h"
#include "core/model/polygon_soup.h"

namespace groundray {
namespace {

/// A node: its children, and the number of elements of its mesh.
struct Node {
  std::vector<std::size_t> children;
  double elements = 0;
};

/// Checks that the traversal of all nodes ends, as assimp assumes, and counts what it yields.
class NodeWalk {
 public:
  static constexpr double most_nodes = 1e6;

  explicit NodeWalk(const std::vector<Node>& nodes) : nodes_(nodes), trees_(nodes.size()) {}

  /// Returns the number of elements of a node and its descendants, each counted as often as it is a
  /// child.
  double elements(std::size_t node) { return walk(node, 0).elements; }

  /// Returns the number of a node and its descendants, each counted as often as it is a child.
  double nodes(std::size_t node) { return walk(node, 0).nodes; }

 private:
  static constexpr int most_levels = 1000;

  struct Tree {
    enum class State { New, Open, Known } state = State::New;
    int levels = 1;
    double nodes = 1, elements = 0;
  };

  const Tree& walk(std::size_t node, int levels_above) {
    Tree& tree = trees_[node];
    if (tree.state == Tree::State::Open)
      throw Error("nodes[{}] contains itself: remove the child that leads back to it", node);
    if (levels_above + tree.levels > most_levels)
      throw Error("nodes[{}] and its descendants are nested more than {} deep", node, most_levels);
    if (tree.state == Tree::State::Known) return tree;
    tree.state = Tree::State::Open;
    tree.elements = nodes_[node].elements;
    for (const std::size_t child : nodes_[node].children) {
      const Tree& below = walk(child, levels_above + 1);
      tree.levels = std::max(tree.levels, below.levels + 1);
      tree.nodes += below.nodes;
      tree.elements += below.elements;
    }
    if (tree.nodes > most_nodes)
      throw Error("nodes[{}] has more than {:g} descendants", node, most_nodes);
    tree.state = Tree::State::Known;
    return tree;
  }

  const std::vector<Node>& nodes_;
  std::vector<Tree> trees_;
};

/// Returns the JSON of a .gltf, or of a .glb whose chunks lie within the file.
std::string_view json_of(std::string_view bytes) {
  if (!bytes.starts_with("glTF")) return bytes;
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    if (at + 4 > bytes.size())
      throw Error("a chunk extends beyond the end: is the file truncated?");
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  constexpr std::size_t header = 12, chunk_header = 8;
  if (word(4) != 2 || word(8) > bytes.size()) {
    throw Error(
        "the header declares version {} and {} bytes, but the file has {}: is it truncated?",
        word(4), word(8), bytes.size());
  }
  for (std::size_t at = header; at < bytes.size();) {
    const std::size_t length = word(at);
    if (at + chunk_header + length > bytes.size()) {
      throw Error("a chunk of {} bytes extends beyond the end: is the file truncated?", length);
    }
    at += chunk_header + length;
  }
  return bytes.substr(header + chunk_header, word(header));
}

/// Returns the data of the chunk after the JSON in a .glb that json_of accepts; empty if there is
/// none.
std::string_view second_chunk(std::string_view bytes, std::string_view text) {
  constexpr std::size_t json_at = 20, chunk_header = 8;
  const std::size_t at = json_at + text.size() + chunk_header;
  if (!bytes.starts_with("glTF") || at > bytes.size()) return {};
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + at - chunk_header, sizeof length);
  return bytes.substr(at, length);
}

/// Rejects deep nesting, on which recursive readers run out of stack; glTF itself needs about ten
/// levels.
void check_nesting(std::string_view text) {
  constexpr int most_levels = 100;
  int levels = 0;
  bool is_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') is_string = !is_string;
    if (is_string) {
      if (c == '\\') ++i;  // the next character, even a quotation mark, belongs to the string
      continue;
    }
    if (c == '[' || c == '{') ++levels;
    if (c == ']' || c == '}') --levels;
    if (levels > most_levels) throw Error("its JSON is nested more than {} deep", most_levels);
  }
}

/// Returns the bytes of an element of an accessor.
double element_bytes(const json& accessor) {
  static const std::map<std::string, int> components{
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
  static const std::map<std::size_t, int> bytes{{5120, 1}, {5121, 1}, {5122, 2},
                                                {5123, 2}, {5125, 4}, {5126, 4}};
  const auto type = components.find(json_text(accessor, "type"));
  if (type == components.end())
    throw Error("type must be SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4");
  const auto component = bytes.find(json_whole(accessor, "componentType"));
  if (component == bytes.end()) throw Error("componentType must be 5120 to 5123, 5125 or 5126");
  return type->second * component->second;
}

void check_views(const json& gltf) {
  const auto number = [](const json& entry, const char* key, std::optional<double> absent = {}) {
    return static_cast<double>(json_whole(entry, key, absent));
  };
  for_each_in(gltf, "bufferViews", [&](const json& view) {
    const double end = number(view, "byteOffset", 0) + number(view, "byteLength");
    const double length =
        number(referred(gltf, "buffers", json_whole(view, "buffer")), "byteLength");
    if (end > length) throw Error("it extends to byte {} of a buffer of {}", end, length);
  });
  for_each_in(gltf, "accessors", [&](const json& accessor) {
    if (!accessor.contains("bufferView")) return;
    const json& view = referred(gltf, "bufferViews", json_whole(accessor, "bufferView"));
    const double element = element_bytes(accessor), count = number(accessor, "count");
    if (count < 1) throw Error("count must be at least 1");
    const double end = number(accessor, "byteOffset", 0) +
                       (count - 1) * number(view, "byteStride", element) + element;
    const double length = number(view, "byteLength");
    if (end > length) throw Error("it extends to byte {} of a view of {}", end, length);
  });
}

/// Returns the number of elements of an accessor of a mesh, an `index` of the file's list.
std::size_t count_of(const json& gltf, std::size_t index) {
  const json& accessor = referred(gltf, "accessors", index);
  if (accessor.contains("sparse")) {
    throw Error(
        "accessors[{}] is sparse, which is not read: export the model without sparse accessors",
        index);
  }
  return json_whole(accessor, "count");
}

std::size_t triangles_of(const json& gltf) {
  constexpr std::array<std::size_t, 7> least{1, 2, 2, 2, 3, 3, 3};  // vertices, by mode
  std::size_t sum = 0;
  for_each_in(gltf, "meshes", [&](const json& mesh) {
    for_each_in(mesh, "primitives", [&](const json& primitive) {
      // 4 triangles, 5 a strip, 6 a fan
      const std::size_t mode = json_whole(primitive, "mode", 4);
      if (mode >= least.size()) throw Error("mode = {} must be 0 to 6", mode);
      const std::size_t accessor = primitive.contains("indices")
                                       ? json_whole(primitive, "indices")
                                       : json_whole(primitive["attributes"], "POSITION");
      const std::size_t count = count_of(gltf, accessor);
      if (count < least[mode]) throw Error("{} vertices are too few for its mode, {}", count, mode);
      if (mode == 4) sum += count / 3;
      if (mode > 4) sum += count - 2;
    });
  });
  return sum;
}

/// Returns the address of an entry's data: part of the file, or the name of another.
std::string uri_of(const json& entry) {
  const std::string uri = json_text(entry, "uri");
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < ' '; };
  if (std::ranges::any_of(uri, is_control)) throw Error("its uri has control characters");
  return uri;
}

/// Checks that all buffers and images are in the file or named files of its folder, and that files
/// hold what buffers declare.
void check_uris(const json& gltf, std::size_t chunk_bytes, const std::filesystem::path& path) {
  const auto is_embedded = [](const std::string& uri) { return uri.starts_with("data:"); };
  for_each_in(gltf, "buffers", [&](const json& buffer) {
    const std::string uri = uri_of(buffer);
    const std::size_t declared = json_whole(buffer, "byteLength");
    double bytes = static_cast<double>(chunk_bytes);
    if (is_embedded(uri)) {
      bytes = 0.75 * static_cast<double>(uri.size());  // base64; the rest is checked by assimp
    } else if (!uri.empty()) {
      std::error_code fault;
      bytes = static_cast<double>(
          std::filesystem::file_size(path.parent_path() / name_beside(uri), fault));
      if (fault) throw Error("{:?} cannot be read: {}", uri, fault.message());
    }
    if (static_cast<double>(declared) > bytes) {
      throw Error("it has {} bytes, but its data {}: is it truncated?", declared,
                  std::floor(bytes));
    }
  });
  for_each_in(gltf, "images", [&](const json& image) {
    const std::string uri = uri_of(image);
    if (!uri.empty() && !is_embedded(uri)) static_cast<void>(name_beside(uri));
    if (!is_embedded(uri)) return;
    const std::string_view type = std::string_view(uri).substr(5, uri.find_first_of(";,") - 5);
    if (!type.empty() && type.find('/') == type.npos)  // assimp crashes
      throw Error("its media type must be image/png or image/jpeg");
  });
}

/// Numbers of vertices and indices of each mesh, each counted as often as a primitive refers to it.
std::vector<double> elements_of_meshes(const json& gltf) {
  std::vector<double> sums;
  for_each_in(gltf, "meshes", [&](const json& mesh) {
    double& sum = sums.emplace_back(0);
    for_each_in(mesh, "primitives", [&](const json& primitive) {
      sum += 1;
      const json& attributes = primitive["attributes"];
      for (const auto& attribute : attributes.items()) {
        const std::size_t accessor = json_whole(attributes, attribute.key().c_str());
        sum += static_cast<double>(count_of(gltf, accessor));
      }
      if (primitive.contains("indices"))
        sum += static_cast<double>(count_of(gltf, json_whole(primitive, "indices")));
    });
  });
  return sums;
}

/// Checks a node's placement, of which assimp reads as many numbers as it needs.
void check_placement(const json& node) {
  for (const auto& [key, count] : {std::pair("matrix", 16U), std::pair("translation", 3U),
                                   std::pair("rotation", 4U), std::pair("scale", 3U)}) {
    const auto found = node.find(key);
    if (found == node.end()) continue;
    const bool is_sound = found->is_array() && found->size() == count &&
                          std::ranges::all_of(*found, [](const json& value) {
                            return value.is_number() && std::isfinite(value.get<float>());
                          });
    if (!is_sound) throw Error("{} must be {} finite numbers", key, count);
  }
}

/// Returns the nodes that an entry lists under `key`, of which the file has `count`.
std::vector<std::size_t> nodes_in(const json& entry, const char* key, std::size_t count) {
  std::vector<std::size_t> nodes;
  for (const json& listed : json_list(entry, key)) {
    if (!listed.is_number()) throw Error("{} must be numbers of nodes", key);
    nodes.push_back(json_whole(listed.get<double>(), key));
    if (nodes.back() >= count) throw Error("there is no nodes[{}]", nodes.back());
  }
  return nodes;
}

/// Checks the nodes, and returns the memory of all meshes, their instances and nodes.
double check_nodes(const json& gltf) {
  const std::size_t count = json_list(gltf, "nodes").size();
  const std::vector<double> meshes = elements_of_meshes(gltf);
  std::vector<Node> nodes;
  for_each_in(gltf, "nodes", [&](const json& from) {
    check_placement(from);
    Node& node = nodes.emplace_back();
    if (from.contains("mesh")) {
      const std::size_t mesh = json_whole(from, "mesh");
      if (mesh >= meshes.size()) throw Error("there is no meshes[{}]", mesh);
      node.elements = meshes[mesh];
    }
    node.children = nodes_in(from, "children", count);
  });
  NodeWalk walk(nodes);
  for (std::size_t i = 0; i < nodes.size(); ++i) walk.elements(i);
  // In assimp's structures and in those of the model.
  constexpr double bytes_per_element = 100, bytes_per_node = 1200;
  double elements = std::accumulate(meshes.begin(), meshes.end(), 0.0), shown = 0;
  for_each_in(gltf, "scenes", [&](const json& scene) {
    for (const std::size_t root : nodes_in(scene, "nodes", count)) {
      elements += walk.elements(root);
      shown += walk.nodes(root);
      if (shown > NodeWalk::most_nodes)
        throw Error("its nodes have more than {:g} descendants", NodeWalk::most_nodes);
    }
  });
  return bytes_per_element * elements + bytes_per_node * shown;
}

/// Checks that the file is glTF 2.
void check_version(const json& gltf) {
  const auto asset = gltf.find("asset");
  if (asset == gltf.end() || !asset->is_object())
    throw Error("it has no asset with a version: is it glTF?");
  const auto version = asset->find("version");
  if (version == asset->end() || !version->is_string())
    throw Error("asset.version must be a text, such as \"2.0\"");
  if (!version->get<std::string>().starts_with("2."))
    throw Error("asset.version = {}, but only glTF 2 is read", version->dump());
}

/// Returns the file for assimp: JSON, or a .glb if there is a second chunk.
std::string file_of(const json& gltf, std::string_view chunk) {
  std::string text = gltf.dump();
  if (chunk.empty()) return text;
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  const auto append = [&](std::size_t word) {
    const auto value = static_cast<std::uint32_t>(word);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append(2);
  append(12 + 8 + text.size() + 8 + chunk.size());
  append(text.size());
  bytes += "JSON" + text;
  append(chunk.size());
  bytes.append("BIN\0", 4) += chunk;
  return bytes;
}

}  // namespace

CheckedGltf check_gltf(std::string_view bytes, const std::filesystem::path& path) {
  double bytes_taken = 0;
  CheckedGltf checked;
  try {
    const std::string_view text = json_of(bytes);
    check_nesting(text);
    json gltf = json::parse(text);
    check_version(gltf);
    strip_gltf(gltf);
    const std::string_view chunk = second_chunk(bytes, text);
    check_uris(gltf, chunk.size(), path);
    check_views(gltf);
    bytes_taken = check_nodes(gltf);
    checked.triangles = triangles_of(gltf);
    checked.is_binary = !chunk.empty();
    checked.bytes = file_of(gltf, chunk);
  } catch (const json::exception& fault) {
    throw Error("{}: it is not valid glTF: {}", path.string(), fault_in_words(fault));
  } catch (const Error& fault) {
    throw Error("{}: {}", path.string(), fault.what());
  }
  require_memory(path.string(), "its meshes and their instances", bytes_taken);
  return checked;
}

}  // namespace groundray
