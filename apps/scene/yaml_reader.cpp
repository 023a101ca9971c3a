#include "apps/scene/yaml_reader.h"

#include <fmt/ranges.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <numeric>
#include <ranges>
#include <sstream>

#include "apps/scene/yaml_syntax.h"
#include "core/io/open_file.h"
#include "core/near_names.h"

namespace groundray::yaml {
namespace {

constexpr std::size_t deepest_level = 32;
constexpr std::size_t most_listed = 200;

// Builds the tree of one document. YAML::Node is not used because it reports neither aliases nor
// repeated keys.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const std::filesystem::path& path) : path_(path) {}

  /// @throws Error if the last quote of `text` is not closed.
  Node take_root(std::string_view text) {
    if (is_open_quote(text, last_scalar_.line + 1, last_scalar_.column + 1))
      refuse(last_scalar_, "this quote is not closed");
    return std::move(root_);
  }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override {
    Node node = make(Node::Kind::Null, mark);
    if (!open_.empty() && open_.back()->kind == Node::Kind::Map &&
        open_.back()->items.size() % 2 == 1) {
      node.line = open_.back()->items.back().line;  // an empty value has the next key's mark
      node.column = open_.back()->items.back().column;
    }
    append(std::move(node));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    refuse(mark, "aliases (*name) are not allowed here: write the value out");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                const std::string& value) override {
    Node node = make(tag == "?" ? Node::Kind::Plain : Node::Kind::Quoted, mark);
    node.text = value;
    last_scalar_ = mark;
    append(std::move(node));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    begin(make(Node::Kind::List, mark), mark);
  }
  void OnSequenceEnd() override { open_.pop_back(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    begin(make(Node::Kind::Map, mark), mark);
  }
  void OnMapEnd() override { open_.pop_back(); }

 private:
  static Node make(Node::Kind kind, const YAML::Mark& mark) {
    return {
        .kind = kind, .line = mark.line + 1, .column = mark.column + 1, .text = {}, .items = {}};
  }

  Node& append(Node node) {
    if (open_.empty()) return root_ = std::move(node);
    // A list grows only while none of its items is open, so that pointers in open_ stay valid.
    return open_.back()->items.emplace_back(std::move(node));
  }

  void begin(Node node, const YAML::Mark& mark) {
    if (open_.size() == deepest_level) refuse(mark, "nested too deeply for a file of groundray");
    open_.push_back(&append(std::move(node)));
  }

  [[noreturn]] void refuse(const YAML::Mark& mark, std::string_view why) const {
    throw Error("{}:{}:{}: {}", path_.string(), mark.line + 1, mark.column + 1, why);
  }

  const std::filesystem::path& path_;
  Node root_;
  YAML::Mark last_scalar_;
  std::vector<Node*> open_;
};

bool is_scalar(const Node& node) {
  return node.kind == Node::Kind::Plain || node.kind == Node::Kind::Quoted;
}

// Returns a text as shown in messages: short, and on one line.
std::string excerpt(std::string_view text) {
  constexpr std::size_t longest = 40;
  std::string shown;
  for (const char c : text.substr(0, longest)) {
    const bool is_control = (c >= 0 && c < ' ') || c == '\x7f';
    shown += is_control ? fmt::format("\\x{:02x}", c) : std::string(1, c);
  }
  return shown + (text.size() > longest ? "..." : "");
}

// Returns the number that a text represents; NaN for infinities, NaN and overflow; nullopt for
// other text.
std::optional<double> spelled_number(std::string_view text) {
  constexpr std::array<std::string_view, 3> not_finite{".inf", "-.inf", ".nan"};
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  });
  if (lower.starts_with('+') && !lower.starts_with("+-")) lower.erase(0, 1);
  if (std::ranges::count(not_finite, lower) > 0) return std::numeric_limits<double>::quiet_NaN();
  double value = 0;
  const auto [end, fault] = std::from_chars(lower.data(), lower.data() + lower.size(), value);
  if (end != lower.data() + lower.size() || fault == std::errc::invalid_argument)
    return std::nullopt;
  if (fault != std::errc{}) return std::numeric_limits<double>::quiet_NaN();
  return value;
}

// Returns the likely fix of a value that must be a number, but is none.
std::string number_fix(const Node& node) {
  if (node.kind == Node::Kind::Quoted && spelled_number(node.text))
    return fmt::format("it is quoted; write {} without quotes", node.text);
  std::string point = node.text;
  std::ranges::replace(point, ',', '.');
  if (node.kind == Node::Kind::Plain && spelled_number(point))
    return fmt::format("write {}, with a decimal point", point);
  return "write it without quotes or unit, in the unit of the key";
}

}  // namespace

std::string read_file(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  constexpr std::uintmax_t largest_file_bytes = 16u << 20;
  std::error_code fault;
  if (!fs::exists(path, fault) || fs::is_directory(path, fault))
    throw Error("{}: {}", path.string(), why_no_file(path));
  if (fs::file_size(path, fault) > largest_file_bytes && !fault) {
    throw Error("{}: larger than the limit of 16 MiB for a YAML file", path.string());
  }
  std::ifstream file = open_stream(path);
  if (!file) throw Error("{}: {}", path.string(), why_not_read(path, errno));
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw Error("{}: {}", path.string(), why_not_read(path, EIO));
  return text;
}

Node parse(const std::string& text, const std::filesystem::path& path) {
  refuse_binary(text, path);
  TreeBuilder tree(path);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(tree)) throw Error("{}:1:1: the file is empty", path.string());
    Node root = tree.take_root(text);
    TreeBuilder second(path);
    if (parser.HandleNextDocument(second)) {
      throw Error("{}:{}:1: a second document begins here: a file must contain one", path.string(),
                  second.take_root(text).line);
    }
    return root;
  } catch (const YAML::Exception& fault) {
    const auto [line, column, words] =
        explain(text, {fault.mark.line + 1, fault.mark.column + 1, fault.msg});
    throw Error("{}:{}:{}: {}", path.string(), line, column, words);
  }
}

std::string shown(const Node& node) {
  if (node.kind == Node::Kind::Null || (is_scalar(node) && node.text.empty())) return "empty";
  if (node.kind == Node::Kind::List) return fmt::format("a list of {}", node.items.size());
  if (node.kind == Node::Kind::Map) return "a map";
  return fmt::format("'{}'", excerpt(node.text));
}

std::string Faults::place(const Node& node) const {
  return fmt::format("{}:{}:{}", path_.string(), node.line, node.column);
}

void Faults::note(const Node& node, std::string_view key, const std::string& message) {
  faults_.push_back(
      {node.line, node.column,
       fmt::format("{}: {}{}", place(node),
                   key.empty() ? "" : fmt::format("key '{}': ", excerpt(key)), message)});
}

void Faults::throw_if_any() {
  if (faults_.empty()) return;
  std::ranges::stable_sort(faults_, {}, [](const Fault& f) { return std::pair(f.line, f.column); });
  const auto [repeated, end] = std::ranges::unique(faults_, {}, &Fault::message);
  faults_.erase(repeated, end);
  std::vector<std::string_view> messages;
  for (const Fault& fault : faults_ | std::views::take(most_listed)) {
    messages.push_back(fault.message);
  }
  const std::string more = fmt::format("\n... and {} more", faults_.size() - messages.size());
  throw Error("{}{}", fmt::join(messages, "\n"), faults_.size() > most_listed ? more : "");
}

std::optional<double> number(const Node& node, std::string_view key, Rule rule, Faults& faults) {
  const auto value = node.kind == Node::Kind::Plain ? spelled_number(node.text) : std::nullopt;
  if (!value) {
    faults.add(node, key, "is {}, but must be a number: {}", shown(node), number_fix(node));
  } else if (!std::isfinite(*value)) {
    faults.add(node, key, "is {}, but must be a finite number", shown(node));
  } else if (!rule.holds(*value)) {
    faults.add(node, key, "is {}, but {}", node.text, rule.words);
  } else {
    return value;
  }
  return std::nullopt;
}

bool numbers(const Node& node, std::string_view key, std::span<double> into, Rule rule,
             Faults& faults) {
  if (node.kind != Node::Kind::List || node.items.size() != into.size()) {
    faults.add(node, key, "is {}, but must be a list of {} numbers", shown(node), into.size());
    return false;
  }
  std::vector<double> values;
  for (const Node& item : node.items) {
    if (const auto value = number(item, key, rule, faults)) values.push_back(*value);
  }
  if (values.size() != into.size()) return false;
  std::ranges::copy(values, into.begin());
  return true;
}

bool is_text(const Node& node, std::string_view key, Faults& faults) {
  const bool has_nul = is_scalar(node) && node.text.find('\0') != std::string::npos;
  if (has_nul) faults.add(node, key, "{} has a NUL character (\\0): remove it", shown(node));
  if (!is_scalar(node) || node.text.empty())
    faults.add(node, key, "is {}, but must be a text", shown(node));
  return is_scalar(node) && !node.text.empty() && !has_nul;
}

Map::Map(const Node& node, std::string_view key, Faults& faults) : node_(node), faults_(faults) {
  if (node.kind != Node::Kind::Map) {
    faults.add(node, key, "is {}, but must be a map of keys and values", shown(node));
    return;
  }
  std::map<std::string_view, int> lines;
  for (std::size_t i = 0; i < node.items.size(); i += 2) {
    const Node& name = node.items[i];
    if (!is_scalar(name)) {
      faults.add(name, key, "{} cannot be a key", shown(name));
    } else if (const auto [first, fresh] = lines.emplace(name.text, name.line); !fresh) {
      faults.add(name, name.text, "repeated; first given in line {}", first->second);
    }
  }
}

const Node* Map::find(std::string_view key, Need need) {
  known_.emplace_back(key);
  if (node_.kind != Node::Kind::Map) return nullptr;
  for (std::size_t i = 0; i < node_.items.size(); i += 2) {
    if (is_scalar(node_.items[i]) && node_.items[i].text == key) return &node_.items[i + 1];
  }
  if (std::ranges::find(absent_, key) == absent_.end()) absent_.emplace_back(key);
  if (need == Need::Required) missing_.emplace_back(key);
  return nullptr;
}

const Node* Map::read_number(std::string_view key, Need need, double& into, Rule rule) {
  const Node* node = find(key, need);
  const auto value = node ? number(*node, key, rule, faults_) : std::nullopt;
  if (!value) return nullptr;
  into = *value;
  return node;
}

const Node* Map::read_number(std::string_view key, Need need, std::optional<double>& into,
                             Rule rule) {
  double value = 0;
  const Node* node = read_number(key, need, value, rule);
  if (node) into = value;
  return node;
}

const Node* Map::read_scaled(std::string_view key, Need need, double scale, double& into,
                             Rule rule) {
  double value = 0;
  const Node* node = read_number(key, need, value, rule);
  if (node) into = value * scale;
  return node;
}

const Node* Map::read_numbers(std::string_view key, Need need, std::span<double> into, Rule rule) {
  const Node* node = find(key, need);
  return node && numbers(*node, key, into, rule, faults_) ? node : nullptr;
}

const Node* Map::read_text(std::string_view key, Need need, std::string& into) {
  const Node* node = find(key, need);
  if (!node || !is_text(*node, key, faults_)) return nullptr;
  into = node->text;
  return node;
}

const Node* Map::read_whole(std::string_view key, Need need, std::uint64_t& into,
                            std::uint64_t max) {
  const Node* node = find(key, need);
  if (!node) return nullptr;
  std::uint64_t value = 0;
  const char* const end = node->text.data() + node->text.size();
  const auto [stop, fault] = std::from_chars(node->text.data(), end, value);
  if (node->kind == Node::Kind::Plain && stop == end && fault == std::errc{} && value <= max) {
    into = value;
    return node;
  }
  const bool is_quoted = node->kind == Node::Kind::Quoted && spelled_number(node->text);
  faults_.add(*node, key, "is {}, but must be a whole number from 0 to {}{}", shown(*node), max,
              is_quoted ? ": " + number_fix(*node) : "");
  return nullptr;
}

const Node* Map::read_choice(std::string_view key, Need need, std::size_t& index,
                             const std::vector<std::string>& words) {
  const Node* node = find(key, need);
  if (!node || !is_text(*node, key, faults_)) return nullptr;
  const auto word = std::ranges::find(words, node->text);
  if (word != words.end()) {
    index = static_cast<std::size_t>(word - words.begin());
    return node;
  }
  faults_.add(*node, key, "is {}, but must be one of {}{}", shown(*node), fmt::join(words, ", "),
              suggestion(node->text, words));
  return nullptr;
}

std::span<const Node> Map::list(std::string_view key, Need need) {
  const Node* node = find(key, need);
  if (!node) return {};
  if (node->kind != Node::Kind::List)
    faults_.add(*node, key, "is {}, but must be a list", shown(*node));
  return node->kind == Node::Kind::List ? std::span(node->items) : std::span<const Node>();
}

std::optional<Map> Map::map(std::string_view key, Need need) {
  const Node* node = find(key, need);
  if (!node) return std::nullopt;
  return std::optional<Map>(std::in_place, *node, key, faults_);
}

void Map::close() {
  if (node_.kind != Node::Kind::Map) return;
  std::ranges::sort(known_);
  known_.erase(std::unique(known_.begin(), known_.end()), known_.end());
  bool are_listed = false;  // in one message only
  for (std::size_t i = 0; i < node_.items.size(); i += 2) {
    const Node& name = node_.items[i];
    if (!is_scalar(name) || std::ranges::count(known_, name.text) > 0) continue;
    const std::vector<std::string> meant = near_names(name.text, absent_);
    const bool is_list_due =
        meant.empty() && !std::exchange(are_listed, are_listed || meant.empty());
    faults_.add(name, name.text, "unknown{}{}", suggestion(name.text, absent_),
                is_list_due ? fmt::format("; the keys here are {}", fmt::join(known_, ", ")) : "");
    if (!meant.empty()) std::erase(missing_, meant.front());
  }
  close_partly();
}

void Map::close_partly() {
  if (node_.kind != Node::Kind::Map) return;
  for (const std::string& key : missing_) faults_.add(node_, key, "missing");
}

void check_version(Map& root, std::string_view key, Faults& faults) {
  std::uint64_t version = 1;
  if (const Node* at = root.read_whole(key, Need::Required, version); at && version != 1) {
    faults.add(*at, key, "is {}, but this version of groundray reads only format 1", version);
  }
}

}  // namespace groundray::yaml
