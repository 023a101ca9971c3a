#include <tinyxml2.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/text_lines.h"
#include "core/model/polygon_soup.h"

namespace groundray {
namespace {

using nlohmann::json;

/// Parts of each node: its children, and the nodes that it instances.
using NodeParts = std::vector<std::vector<std::size_t>>;

/// Checks that the traversal of all parts of a node ends, as assimp assumes.
class NodeWalk {
 public:
  NodeWalk(const NodeParts& parts, std::function<std::string(std::size_t)> name_of)
      : parts_(parts), name_of_(std::move(name_of)), trees_(parts.size()) {}

  void check() {
    for (std::size_t node = 0; node < parts_.size(); ++node) walk(node, 0);
  }

 private:
  static constexpr int most_levels = 1000;
  static constexpr double most_nodes = 1e6;

  /// Size of the tree of a node's parts.
  struct Tree {
    enum class State { New, Open, Known } state = State::New;
    int levels = 1;
    double nodes = 1;  // each counted as often as it is a part
  };

  const Tree& walk(std::size_t node, int levels_above) {
    Tree& tree = trees_[node];
    if (tree.state == Tree::State::Open) {
      throw Error("{} contains itself: remove the child or instance that leads back to it",
                  name_of_(node));
    }
    if (levels_above + tree.levels > most_levels) {
      throw Error("{} and its descendants are nested more than {} deep", name_of_(node),
                  most_levels);
    }
    if (tree.state == Tree::State::Known) return tree;
    tree.state = Tree::State::Open;
    for (const std::size_t part : parts_[node]) {
      const Tree& below = walk(part, levels_above + 1);
      tree.levels = std::max(tree.levels, below.levels + 1);
      tree.nodes += below.nodes;
    }
    if (tree.nodes > most_nodes) {
      throw Error("{} has more than {:g} descendants, including those of its instances",
                  name_of_(node), most_nodes);
    }
    tree.state = Tree::State::Known;
    return tree;
  }

  const NodeParts& parts_;
  const std::function<std::string(std::size_t)> name_of_;
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

std::size_t components_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  if (type == "MAT4") return 16;
  if (type == "MAT3") return 9;
  return type == "VEC2" ? 2 : type == "VEC3" ? 3 : 4;
}

std::size_t bytes_of(int component_type) {
  if (component_type == 5120 || component_type == 5121) return 1;
  return component_type == 5122 || component_type == 5123 ? 2 : 4;
}

void check_views(const json& gltf) {
  const json none = json::array();
  const auto views = gltf.value("bufferViews", none), buffers = gltf.value("buffers", none);
  for (const json& view : views) {
    const double end = view.value("byteOffset", 0.0) + view.at("byteLength").get<double>();
    const json& buffer = buffers.at(view.at("buffer").get<std::size_t>());
    if (!(view.value("byteOffset", 0.0) >= 0 && end <= buffer.at("byteLength").get<double>())) {
      throw Error("a view extends to byte {} of a buffer of {}", end,
                  buffer.at("byteLength").dump());
    }
  }
  for (const json& accessor : gltf.value("accessors", none)) {
    if (!accessor.contains("bufferView")) continue;
    const json& view = views.at(accessor.at("bufferView").get<std::size_t>());
    const auto element = static_cast<double>(components_of(accessor.at("type").get<std::string>()) *
                                             bytes_of(accessor.at("componentType").get<int>()));
    const double offset = accessor.value("byteOffset", 0.0);
    const double count = accessor.at("count").get<double>();
    const double end = offset + (count - 1) * view.value("byteStride", element) + element;
    if (!(offset >= 0 && count >= 1 && end <= view.at("byteLength").get<double>())) {
      throw Error("an accessor extends to byte {} of a view of {}", end,
                  view.at("byteLength").dump());
    }
  }
}

std::size_t triangles_of(const json& gltf) {
  std::size_t sum = 0;
  for (const json& mesh : gltf.value("meshes", json::array())) {
    for (const json& primitive : mesh.at("primitives")) {
      const int mode = primitive.value("mode", 4);  // 4 triangles, 5 a strip, 6 a fan
      const auto own = primitive.find("indices");
      const json& accessor =
          own != primitive.end() ? *own : primitive.at("attributes").at("POSITION");
      const auto count =
          gltf.at("accessors").at(accessor.get<std::size_t>()).at("count").get<std::size_t>();
      if (mode == 4) sum += count / 3;
      if (mode > 4 && count > 2) sum += count - 2;
    }
  }
  return sum;
}

void check_nodes(const json& gltf) {
  const auto nodes = gltf.value("nodes", json::array());
  NodeParts parts;
  for (const json& node : nodes) {
    auto& children = parts.emplace_back();
    for (const json& child : node.value("children", json::array())) {
      children.push_back(child.get<std::size_t>());
      if (children.back() < nodes.size()) continue;
      throw Error("node {} has the child {}, but there are {} nodes", parts.size() - 1,
                  child.dump(), nodes.size());
    }
  }
  NodeWalk(parts, [](std::size_t node) { return fmt::format("node {}", node); }).check();
}

/// Nodes of a Collada file and their instances.
class ColladaNodes {
 public:
  void enter(const tinyxml2::XMLElement& element) {
    const std::size_t node = elements_.size();
    const std::string id = text_of(element, "id");
    if (!open_.empty()) {
      parts_[open_.back()].push_back(node);
    } else if (element.Name() == std::string_view("node")) {
      library_.emplace(id, node);
    }
    named_.emplace(id, node);
    if (text_of(element, "name") != id) named_.emplace(text_of(element, "name"), node);
    elements_.push_back(&element);
    parts_.emplace_back();
    open_.push_back(node);
  }

  void leave() { open_.pop_back(); }

  void add_instance(const tinyxml2::XMLElement& element) {
    const std::string url = text_of(element, "url");
    if (open_.empty() || !url.starts_with('#')) return;
    instances_.emplace_back(open_.back(), url.substr(1));
  }

  void check() {
    for (const auto& [node, name] : instances_) {
      // assimp searches the library by id, then the scene by id or name.
      const auto [first, last] = (library_.contains(name) ? library_ : named_).equal_range(name);
      for (auto it = first; it != last; ++it) parts_[node].push_back(it->second);
    }
    const auto name_of = [&](std::size_t node) {
      return fmt::format("line {}: {} {:?}", elements_[node]->GetLineNum(), elements_[node]->Name(),
                         text_of(*elements_[node], "id"));
    };
    NodeWalk(parts_, name_of).check();
  }

 private:
  static std::string text_of(const tinyxml2::XMLElement& element, const char* attribute) {
    const char* const text = element.Attribute(attribute);
    return text != nullptr ? text : "";
  }

  std::vector<const tinyxml2::XMLElement*> elements_;
  NodeParts parts_;
  std::vector<std::size_t> open_;
  std::multimap<std::string, std::size_t> library_, named_;
  std::vector<std::pair<std::size_t, std::string>> instances_;
};

/// Collects unit, up axis and nodes, and rejects malformed numbers.
class ColladaCheck : public tinyxml2::XMLVisitor {
 public:
  ColladaAsset asset;
  ColladaNodes nodes;

  bool VisitEnter(const tinyxml2::XMLElement& element,  // NOLINT(readability-identifier-naming)
                  const tinyxml2::XMLAttribute* /*first*/) override {
    const std::string_view name = element.Name();
    const std::string_view text = element.GetText() != nullptr ? element.GetText() : "";
    if (name == "unit") {
      const char* const meter = element.Attribute("meter");
      const auto value = number_of<double>(meter != nullptr ? meter : "1");
      if (!value || !(*value > 0)) throw Error("unit: meter must be a positive number");
      asset.metres_per_unit = *value;
    } else if (name == "up_axis") {
      if (text.find("X_UP") != std::string_view::npos) asset.up = UpAxis::X;
      if (text.find("Z_UP") != std::string_view::npos) asset.up = UpAxis::Z;
    } else if (is_node(name)) {
      nodes.enter(element);
    } else if (name == "instance_node") {
      nodes.add_instance(element);
    } else if (name == "p" || name == "vcount" || name == "h") {
      check_characters(element, text, "0123456789- \t\r\n");
    } else if (name == "float_array") {
      check_characters(element, text, "0123456789+-.eEnNaAiIfFtTyY \t\r\n");  // also NaN, Infinity
      if (element.Int64Attribute("count", -1) < 0) {
        throw Error("line {}: float_array must have a count", element.GetLineNum());
      }
    }
    return true;
  }

  bool VisitExit(
      const tinyxml2::XMLElement& element) override {  // NOLINT(readability-identifier-naming)
    if (is_node(element.Name())) nodes.leave();
    return true;
  }

 private:
  static bool is_node(std::string_view element) {
    return element == "node" || element == "visual_scene";
  }

  static void check_characters(const tinyxml2::XMLElement& element, std::string_view text,
                               std::string_view all) {
    const std::size_t at = text.find_first_not_of(all);
    if (at == std::string_view::npos) return;
    throw Error("line {}: {:?} in {} is not a number", element.GetLineNum(), text.substr(at, 20),
                element.Name());
  }
};

}  // namespace

std::size_t check_gltf(std::string_view bytes, const std::string& name) {
  try {
    const std::string_view text = json_of(bytes);
    check_nesting(text);
    const json gltf = json::parse(text);
    check_views(gltf);
    check_nodes(gltf);
    return triangles_of(gltf);
  } catch (const json::exception& fault) {
    throw Error("{}: {}", name, fault.what());
  } catch (const Error& fault) {
    throw Error("{}: {}", name, fault.what());
  }
}

ColladaAsset check_collada(std::string_view text, const std::string& name) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    throw Error("{}:{}: it is not valid XML: {}", name, document.ErrorLineNum(),
                document.ErrorStr());
  }
  ColladaCheck check;
  try {
    document.Accept(&check);
    check.nodes.check();
  } catch (const Error& fault) {
    throw Error("{}: {}", name, fault.what());
  }
  return check.asset;
}

}  // namespace groundray
