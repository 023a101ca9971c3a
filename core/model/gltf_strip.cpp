#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/model/gltf_json.h"

namespace groundray {
namespace {

/// Removes all members of an object but some.
void keep_members(json& object, const auto& is_kept) {
  json kept = json::object();
  for (auto& [key, value] : object.items())
    if (is_kept(key)) kept[key] = std::move(value);
  object = std::move(kept);
}

/// Removes the extensions of all objects in an object, such as transforms of textures' uv.
void erase_extensions_in(json& value) {
  for (json& part : value) {
    if (part.is_object()) part.erase("extensions");
    if (part.is_structured()) erase_extensions_in(part);
  }
}

/// Removes what groundray does not read from a mesh: targets of morphs, colours, weights of joints,
/// and primitives without positions.
void strip_mesh(json& mesh) {
  if (!mesh.contains("primitives")) throw Error("primitives is missing");
  mesh.erase("weights");
  for_each_in(mesh, "primitives", [](json& primitive) {
    const auto extensions = primitive.find("extensions");
    if (extensions != primitive.end() && extensions->contains("KHR_draco_mesh_compression"))
      throw Error("it is compressed, which is not read: export the model without compression");
    for (const char* key : {"targets", "extensions"}) primitive.erase(key);
    json_object(primitive, "attributes");
    keep_members(primitive["attributes"], [](std::string_view key) {
      constexpr std::string_view uv = "TEXCOORD_";
      const bool is_uv = key.starts_with(uv) && key.size() == uv.size() + 1 && key.back() >= '0' &&
                         key.back() <= '9';
      return key == "POSITION" || key == "NORMAL" || is_uv;
    });
  });
  json kept = json::array();
  for (json& primitive : mesh["primitives"])
    if (primitive["attributes"].contains("POSITION")) kept.push_back(std::move(primitive));
  mesh["primitives"] = std::move(kept);
}

}  // namespace

void strip_gltf(json& gltf) {
  static const std::set<std::string, std::less<>> used{"asset",       "scene",
                                                       "scenes",      "nodes",
                                                       "meshes",      "accessors",
                                                       "bufferViews", "buffers",
                                                       "textures",    "images",
                                                       "samplers",    "extensionsUsed",
                                                       "materials",   "extensionsRequired"};
  keep_members(gltf, [](std::string_view key) { return used.contains(key); });
  for_each_in(gltf, "nodes", [](json& node) {
    for (const char* key : {"skin", "camera", "weights", "extensions", "extras"}) node.erase(key);
  });
  for_each_in(gltf, "images", [](json& image) {
    const std::string type = json_text(image, "mimeType");
    if (type != "image/png" && type != "image/jpeg") image.erase("mimeType");  // assimp may crash
  });
  for_each_in(gltf, "materials", [](json& material) { erase_extensions_in(material); });
  for_each_in(gltf, "meshes", strip_mesh);
}

}  // namespace groundray
