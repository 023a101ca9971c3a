#include <assimp/BaseImporter.h>
#include <assimp/GltfMaterial.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/importerdesc.h>
#include <assimp/material.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdint>
#include <exception>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <initializer_list>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/file_io.h"
#include "core/model/polygon_soup.h"

namespace groundray {
namespace {

using SoupSurface = PolygonSoup::Surface;

enum class Form { Stl, Gltf };

/// Adds to a soup what assimp read. Arrays are never accessed out of bounds, whatever assimp's
/// indices.
class SceneReader {
 public:
  SceneReader(const aiScene& scene, Form form, const std::string& name)
      : scene_(scene),
        form_(form),
        name_(name),
        surfaces_(scene.mNumMaterials + std::size_t{1}, PolygonSoup::none) {}

  PolygonSoup read() && {
    for (unsigned i = 0; i < scene_.mNumMeshes; ++i) {
      const aiMesh& mesh = *scene_.mMeshes[i];
      soup_.faces += static_cast<std::size_t>(
          std::count_if(mesh.mFaces, mesh.mFaces + mesh.mNumFaces,
                        [](const aiFace& face) { return face.mNumIndices > 2; }));
    }
    if (scene_.mRootNode != nullptr) add(*scene_.mRootNode, glm::dmat4(1), glm::dmat4(1), 1);
    return std::move(soup_);
  }

 private:
  /// @param M_FA       transforms from the node's parent to the file's frame F.
  /// @param size       product of the same matrices with the absolute values of their elements.
  /// @param roundings  number of float factors in the product; with `size` it bounds their rounding
  ///         error.
  void add(const aiNode& node, const glm::dmat4& M_FA, const glm::dmat4& size, int roundings) {
    glm::dmat4 own, own_size;
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        const auto value = static_cast<double>(
            node.mTransformation[static_cast<unsigned>(row)][static_cast<unsigned>(column)]);
        own[column][row] = value;
        own_size[column][row] = std::abs(value);
      }
    }
    const glm::dmat4 M_FN = M_FA * own, node_size = size * own_size;
    if (own != glm::dmat4(1)) ++roundings;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      if (node.mMeshes[i] >= scene_.mNumMeshes) continue;
      add(*scene_.mMeshes[node.mMeshes[i]], M_FN, node_size, roundings);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) {
      add(*node.mChildren[i], M_FN, node_size, roundings);
    }
  }

  void add(const aiMesh& mesh, const glm::dmat4& M_FN, const glm::dmat4& size, int roundings) {
    const std::uint32_t surface = surface_of(mesh.mMaterialIndex);
    const aiVector3D* const uv = mesh.mTextureCoords[uv_channels_[surface]];
    const glm::dmat3 linear(M_FN);
    // glTF requires the winding of mirrored nodes to be reversed, so that the outside stays
    // outside.
    const bool is_mirrored = glm::determinant(linear) < 0;
    const glm::dmat3 for_normals =
        (is_mirrored ? -1.0 : 1.0) * glm::dmat3(glm::cross(linear[1], linear[2]),
                                                glm::cross(linear[2], linear[0]),
                                                glm::cross(linear[0], linear[1]));
    // The normals of STL are those of the facets.
    const aiVector3D* const normals = form_ == Form::Stl ? nullptr : mesh.mNormals;
    const PolygonSoup::Corner none;
    const PolygonSoup::Corner first{
        static_cast<std::uint32_t>(soup_.positions.size()),
        uv != nullptr ? static_cast<std::uint32_t>(soup_.uv.size()) : none.uv,
        normals != nullptr ? static_cast<std::uint32_t>(soup_.normals.size()) : none.normal};
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      add_position(vector_of(mesh.mVertices[i]), M_FN, size, roundings);
      if (uv != nullptr) soup_.uv.emplace_back(uv[i].x, uv[i].y);
      if (normals != nullptr) soup_.normals.emplace_back(for_normals * vector_of(normals[i]));
    }
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices < 3) {
        soup_.skipped += face.mNumIndices > 0 ? 1 : 0;
        continue;
      }
      soup_.polygons.push_back({soup_.corners.size(), face.mNumIndices, surface});
      for (unsigned k = 0; k < face.mNumIndices; ++k) {
        const unsigned at = face.mIndices[is_mirrored ? face.mNumIndices - 1 - k : k];
        PolygonSoup::Corner corner;
        if (at < mesh.mNumVertices) {
          corner.position = first.position + at;
          if (uv != nullptr) corner.uv = first.uv + at;
          if (normals != nullptr) corner.normal = first.normal + at;
        }
        soup_.corners.push_back(corner);
      }
    }
  }

  void add_position(const glm::dvec3& p_NQ, const glm::dmat4& M_FN, const glm::dmat4& size,
                    int roundings) {
    constexpr double half_ulp = std::numeric_limits<float>::epsilon() / 2.0;
    const glm::dvec4 p(p_NQ, 1);
    soup_.positions.emplace_back(M_FN * p);
    const glm::dvec4 lost = size * glm::abs(p) * (half_ulp * roundings);
    const double most = std::max({lost.x, lost.y, lost.z});
    if (std::isfinite(most)) soup_.rounding = std::max(soup_.rounding, most);
  }

  static glm::dvec3 vector_of(const aiVector3D& v) { return {v.x, v.y, v.z}; }

  /// Returns the soup's index of the surface for a material, and adds the surface if it is new.
  std::uint32_t surface_of(unsigned material) {
    auto& number = surfaces_[std::min(material, scene_.mNumMaterials)];
    if (number == PolygonSoup::none) {
      number = static_cast<std::uint32_t>(soup_.surfaces.size());
      uv_channels_.push_back(0);
      soup_.surfaces.push_back({.looks = {.name = "default"}});
      if (material < scene_.mNumMaterials) read(*scene_.mMaterials[material]);
    }
    return number;
  }

  void read(const aiMaterial& material) {
    SoupSurface& surface = soup_.surfaces.back();
    const auto image = [&](std::initializer_list<aiTextureType> types, ModelImage& pixels) {
      return this->image(material, types, pixels);
    };
    surface.normal = image({aiTextureType_NORMALS, aiTextureType_HEIGHT}, surface.looks.normal);
    surface.opacity = image({aiTextureType_OPACITY}, surface.looks.opacity);
    // Read last, because its uv become the surface's.
    surface.albedo = image({aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}, surface.looks.albedo);
    if (form_ == Form::Stl) return;  // it has no materials: assimp invents names and colours
    surface.looks.name = material.GetName().C_Str();
    aiColor4D color(1, 1, 1, 1);
    if (material.Get(AI_MATKEY_BASE_COLOR, color) != AI_SUCCESS)
      material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
    surface.looks.color = {color.r, color.g, color.b};
    surface.looks.least_alpha = least_alpha(material, color.a);
  }

  /// Returns the alpha of the map below which the surface is cut out. In glTF, alpha is the map's
  /// times the factor's, and blended surfaces are cut out below 1/2.
  static float least_alpha(const aiMaterial& material, float factor) {
    aiString mode("OPAQUE");
    material.Get(AI_MATKEY_GLTF_ALPHAMODE, mode);
    const bool is_mask = std::string_view(mode.C_Str()) == "MASK";
    if (!is_mask && std::string_view(mode.C_Str()) != "BLEND") return 0;
    float cutoff = 0.5f;
    if (is_mask) material.Get(AI_MATKEY_GLTF_ALPHACUTOFF, cutoff);
    return cutoff / std::max(factor, std::numeric_limits<float>::min());
  }

  /// Returns the name of the first image of these types, or an empty name. An image that is
  /// embedded in the file is decoded to `pixels` instead, and has an empty name.
  std::string image(const aiMaterial& material, std::initializer_list<aiTextureType> types,
                    ModelImage& pixels) {
    for (const aiTextureType type : types) {
      aiString name;
      unsigned channel = 0;
      if (material.GetTexture(type, 0, &name, nullptr, &channel) != AI_SUCCESS) continue;
      if (name.length == 0) continue;
      if (channel < AI_MAX_NUMBER_OF_TEXTURECOORDS) uv_channels_.back() = channel;
      const aiTexture* const embedded = scene_.GetEmbeddedTexture(name.C_Str());
      if (embedded == nullptr) return name.C_Str();
      if (embedded->mHeight != 0)
        throw Error("{}: image {} is not compressed", name_, name.C_Str());
      pixels.pixels =
          parse_image8({reinterpret_cast<const char*>(embedded->pcData), embedded->mWidth},
                       name_ + ", image " + name.C_Str());
      decoded_ += std::int64_t{pixels.pixels.width()} * pixels.pixels.height();
      if (decoded_ > most_image_pixels) {
        throw Error("{}: the images of its surfaces have more than {} pixels; scale them down",
                    name_, most_image_pixels);
      }
      return {};
    }
    return {};
  }

  const aiScene& scene_;
  const Form form_;
  const std::string& name_;
  PolygonSoup soup_;
  std::int64_t decoded_ = 0;             // pixels
  std::vector<std::uint32_t> surfaces_;  // by material; the last is for meshes without one
  std::vector<unsigned> uv_channels_;    // by surface
};

/// Removes all readers from the importer except the one for the requested format, so that it does
/// not guess formats.
void keep_only(Assimp::Importer& importer, std::string_view reader) {
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    if (reader == importer.GetImporterInfo(i)->mName) continue;
    const std::unique_ptr<Assimp::BaseImporter> ours_then(importer.GetImporter(i));
    importer.UnregisterLoader(ours_then.get());
  }
}

/// A file in memory, for assimp.
class FileInMemory : private std::string, public Assimp::MemoryIOStream {
 public:
  explicit FileInMemory(std::string bytes)
      : std::string(std::move(bytes)),
        MemoryIOStream(reinterpret_cast<const std::uint8_t*>(data()), size()) {}
};

/// Files as assimp sees them: one in memory, and those in its folder or below.
class FilesBeside : public Assimp::IOSystem {
 public:
  FilesBeside(const std::filesystem::path& folder, std::string name, std::string bytes)
      : folder_(folder), name_(std::move(name)), bytes_(std::move(bytes)) {}

  // NOLINTBEGIN(readability-identifier-naming): assimp's names
  bool Exists(const char* file) const override {
    std::error_code ignored;
    return file == name_ || std::filesystem::is_regular_file(folder_ / name_beside(file), ignored);
  }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (*mode != 'r') return nullptr;
    return new FileInMemory(file == name_ ? bytes_ : read_text(folder_ / name_beside(file)));
  }
  void Close(Assimp::IOStream* file) override { delete file; }
  // NOLINTEND(readability-identifier-naming)

 private:
  std::filesystem::path folder_;
  std::string name_, bytes_;
};

/// Returns the first sentence of assimp's reason, without its marks of a format and its name for
/// the file.
std::string words_of_assimp(std::string why) {
  for (const std::string_view mark : {"GLTF: ", "GLTF2: ", "STL: "})
    if (why.starts_with(mark)) why.erase(0, mark.size());
  if (const auto at = why.find(" for model."); at != std::string::npos) why.resize(at);
  for (char& c : why)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  while (why.ends_with('.')) why.pop_back();
  return why;
}

/// Reads a file of which assimp gets `bytes`.
PolygonSoup read_scene(const std::filesystem::path& path, Form form, std::string_view ending,
                       std::string bytes) {
  const std::string name = path.string();
  try {
    Assimp::Importer importer;
    keep_only(importer, form == Form::Stl ? "Stereolithography (STL) Importer" : "glTF2 Importer");
    const std::string inner = fmt::format("model{}", ending);
    importer.SetIOHandler(new FilesBeside(path.parent_path(), inner, std::move(bytes)));
    const aiScene* const scene = importer.ReadFile(inner, 0);
    if (scene == nullptr) {
      throw Error("{}: {} cannot be read: {}{}", name, form == Form::Stl ? "its STL" : "its glTF",
                  words_of_assimp(importer.GetErrorString()),
                  form == Form::Stl ? "; was the file cut short?" : "");
    }
    return SceneReader(*scene, form, name).read();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& fault) {
    throw Error("{}: assimp cannot read it: {}", name, fault.what());
  }
}

}  // namespace

PolygonSoup read_stl(const std::filesystem::path& path, std::string bytes) {
  return read_scene(path, Form::Stl, ".stl", std::move(bytes));
}

PolygonSoup read_gltf(const std::filesystem::path& path, std::string_view bytes) {
  CheckedGltf checked = check_gltf(bytes, path);
  PolygonSoup soup =
      read_scene(path, Form::Gltf, checked.is_binary ? ".glb" : ".gltf", std::move(checked.bytes));
  soup.omitted = checked.triangles - std::min(checked.triangles, soup.faces);
  return soup;
}

}  // namespace groundray
