#include "core/scene_check.h"

#include <tinyxml2.h>

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/text_lines.h"

namespace groundray {
namespace {

using nlohmann::json;

/// Returns the JSON of a .gltf, or of a .glb whose chunks lie within it.
std::string_view json_of(std::string_view bytes) {
  if (!bytes.starts_with("glTF")) return bytes;
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    if (at + 4 > bytes.size()) throw Error("a chunk goes beyond the end: is the file cut short?");
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  constexpr std::size_t header = 12, chunk_header = 8;
  if (word(4) != 2 || word(8) > bytes.size()) {
    throw Error("version {} of {} bytes, {} are there: is the file cut short?", word(4), word(8),
                bytes.size());
  }
  for (std::size_t at = header; at < bytes.size();) {
    const std::size_t length = word(at);
    if (at + chunk_header + length > bytes.size()) {
      throw Error("a chunk of {} bytes goes beyond the end: is the file cut short?", length);
    }
    at += chunk_header + length;
  }
  return bytes.substr(header + chunk_header, word(header));
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
      throw Error("a view goes to byte {} of a buffer of {}", end, buffer.at("byteLength").dump());
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
      throw Error("an accessor goes to byte {} of a view of {}", end, view.at("byteLength").dump());
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

/// Finds unit and axis, and numbers that are none.
class ColladaCheck : public tinyxml2::XMLVisitor {
 public:
  ColladaAsset asset;

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

 private:
  static void check_characters(const tinyxml2::XMLElement& element, std::string_view text,
                               std::string_view all) {
    const std::size_t at = text.find_first_not_of(all);
    if (at == std::string_view::npos) return;
    throw Error("line {}: {:?} in {} is no number", element.GetLineNum(), text.substr(at, 20),
                element.Name());
  }
};

}  // namespace

std::size_t check_gltf(std::string_view bytes, const std::string& name) {
  try {
    const json gltf = json::parse(json_of(bytes));
    check_views(gltf);
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
    throw Error("{}:{}: it is no XML: {}", name, document.ErrorLineNum(), document.ErrorStr());
  }
  ColladaCheck check;
  try {
    document.Accept(&check);
  } catch (const Error& fault) {
    throw Error("{}: {}", name, fault.what());
  }
  return check.asset;
}

}  // namespace groundray
