#include "apps/scene/sampling/key_path.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <system_error>

namespace groundray::sampling {
namespace {

using yaml::Node;

// Returns the index, among a map's or list's items, of the value that a part of a path names.
std::optional<std::size_t> child_of(const Node& node, std::string_view part) {
  if (node.kind == Node::Kind::Map) {
    for (std::size_t i = 0; i + 1 < node.items.size(); i += 2)
      if (node.items[i].text == part) return i + 1;
    return std::nullopt;
  }
  if (node.kind != Node::Kind::List) return std::nullopt;
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    const Node& item = node.items[i];
    const auto name = item.kind == Node::Kind::Map ? child_of(item, "name") : std::nullopt;
    if (name && item.items[*name].text == part) return i;
  }
  std::size_t index = 0;
  const auto [end, fault] = std::from_chars(part.data(), part.data() + part.size(), index);
  const bool is_index = fault == std::errc{} && end == part.data() + part.size();
  return is_index && index < node.items.size() ? std::optional(index) : std::nullopt;
}

// Returns the node that holds the last part of a path.
Node& holder_of(Node& root, const KeyPath& path) {
  Node* at = &root;
  for (auto part = path.begin(); part + 1 != path.end(); ++part)
    at = &at->items[child_of(*at, *part).value()];
  return *at;
}

}  // namespace

KeyPath parse_key_path(std::string_view text) {
  KeyPath path;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find('.', from), text.size());
    path.emplace_back(text.substr(from, to - from));
    from = to + 1;
  }
  return path;
}

const Node* find(const Node& root, const KeyPath& path) {
  const Node* at = &root;
  for (const std::string& part : path) {
    const auto child = child_of(*at, part);
    if (!child) return nullptr;
    at = &at->items[*child];
  }
  return at;
}

std::string first_missing(const Node& root, const KeyPath& path) {
  const Node* at = &root;
  for (auto part = path.begin(); part != path.end(); ++part) {
    const auto child = child_of(*at, *part);
    const bool is_new_key = part + 1 == path.end() && at->kind == Node::Kind::Map;
    if (!child) return is_new_key && !part->empty() ? "" : "'" + *part + "'";
    at = &at->items[*child];
  }
  return "";
}

void set(Node& root, const KeyPath& path, const Node& value) {
  Node& holder = holder_of(root, path);
  if (const auto child = child_of(holder, path.back())) {
    holder.items[*child] = value;
    return;
  }
  holder.items.push_back({.kind = Node::Kind::Plain,
                          .line = value.line,
                          .column = value.column,
                          .text = path.back(),
                          .items = {}});
  holder.items.push_back(value);
}

void remove(Node& root, const std::vector<KeyPath>& paths) {
  std::vector<std::vector<std::size_t>> places;  // indices on the way from the root
  for (const KeyPath& path : paths) {
    const Node* at = &root;
    std::vector<std::size_t>& place = places.emplace_back();
    for (const std::string& part : path) {
      place.push_back(child_of(*at, part).value());
      at = &at->items[place.back()];
    }
  }
  // From the last to the first, parts of others before these, so that all other indices stay.
  std::ranges::sort(places, std::greater{});
  for (const std::vector<std::size_t>& place : places) {
    Node* holder = &root;
    for (const std::size_t index : std::span(place).first(place.size() - 1))
      holder = &holder->items[index];
    const auto last = holder->items.begin() + static_cast<std::ptrdiff_t>(place.back());
    holder->items.erase(holder->kind == Node::Kind::Map ? last - 1 : last, last + 1);
  }
}

bool overlap(const KeyPath& a, const KeyPath& b) {
  const std::size_t shorter = std::min(a.size(), b.size());
  return std::equal(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(shorter), b.begin());
}

}  // namespace groundray::sampling
