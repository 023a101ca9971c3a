#include "apps/scene/yaml_writer.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstddef>

namespace groundray::yaml {
namespace {

bool is_collection(const Node& node) {
  return node.kind == Node::Kind::List || node.kind == Node::Kind::Map;
}

void write(const Node& node, YAML::Emitter& out);

void write_list(const Node& node, YAML::Emitter& out) {
  if (std::ranges::none_of(node.items, is_collection)) out << YAML::Flow;
  out << YAML::BeginSeq;
  for (const Node& item : node.items) write(item, out);
  out << YAML::EndSeq;
}

void write_map(const Node& node, YAML::Emitter& out) {
  out << YAML::BeginMap;
  for (std::size_t i = 0; i + 1 < node.items.size(); i += 2) {
    out << YAML::Key;
    write(node.items[i], out);
    out << YAML::Value;
    write(node.items[i + 1], out);
  }
  out << YAML::EndMap;
}

void write(const Node& node, YAML::Emitter& out) {
  switch (node.kind) {
    case Node::Kind::Null:
      out << YAML::Null;
      break;
    case Node::Kind::Plain:
      out << node.text;
      break;
    case Node::Kind::Quoted:
      out << YAML::DoubleQuoted << node.text;
      break;
    case Node::Kind::List:
      write_list(node, out);
      break;
    case Node::Kind::Map:
      write_map(node, out);
      break;
  }
}

}  // namespace

std::string text_of(const Node& node) {
  YAML::Emitter out;
  write(node, out);
  return std::string(out.c_str(), out.size()) + "\n";
}

std::string line_of(const Node& node) {
  YAML::Emitter out;
  out.SetSeqFormat(YAML::Flow);
  out.SetMapFormat(YAML::Flow);
  write(node, out);
  return {out.c_str(), out.size()};
}

}  // namespace groundray::yaml
