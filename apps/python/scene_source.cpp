#include "apps/python/scene_source.h"

#include <fmt/format.h>

#include <cerrno>
#include <string>
#include <variant>

#include "core/error.h"
#include "core/model/model_io.h"

namespace groundray::python {
namespace {

// Models of the meshes of a scene, each made on first use.
class GivenModels {
 public:
  explicit GivenModels(const std::map<std::string, Mesh>& meshes) : meshes_(meshes) {}

  void put_into(ModelSpec& spec, const std::string& where, const std::string& subject) {
    const auto* const file = std::get_if<ModelSource>(&spec.source);
    if (file == nullptr) return;
    const auto mesh = meshes_.find(file->file.string());
    if (mesh == meshes_.end()) return;
    const auto& [metres_per_unit, up, broken] = file->options;
    if (metres_per_unit || up || broken != BrokenParts::Refuse || file->displacement) {
      throw Error(
          "{}: {}: metres_per_unit, up, broken and displacement are for files, but its model is a "
          "Mesh, which is in metres with z up: remove these keys",
          where, subject);
    }
    auto& model = models_[mesh->first];
    if (!model) {
      model = std::make_shared<const Model>(
          model_from(mesh->second.measured.shape, fmt::format("{}: {}: its Mesh", where, subject)));
    }
    spec.source = GivenModel{model};
  }

 private:
  const std::map<std::string, Mesh>& meshes_;
  std::map<std::string, std::shared_ptr<const Model>> models_;
};

// Puts a trajectory in memory in the place of the file that a platform or object names.
void put_trajectory(const SceneSource& source, auto& place) {
  auto* const path = std::get_if<RecordedPath>(&place);
  if (path == nullptr) return;
  const auto given = source.trajectories.find(path->tum.string());
  if (given != source.trajectories.end()) path->text = given->second;
}

}  // namespace

void use_given(const SceneSource& source, SceneSpec& spec) {
  put_trajectory(source, spec.platform);
  GivenModels models(source.meshes);
  for (ObjectSpec& object : spec.objects) {
    models.put_into(object.model, object.where, fmt::format("object '{}'", object.name));
    put_trajectory(source, object.place);
  }
  for (ScatterLayer& layer : spec.scatter) {
    for (ModelSpec& model : layer.models)
      models.put_into(model, layer.where, fmt::format("layer '{}'", layer.name));
  }
}

std::shared_ptr<const TemporaryFolder> use_terrain(const SceneSource& source, SceneSpec& spec) {
  if (!source.terrain) return nullptr;
  auto folder = std::make_shared<const TemporaryFolder>();
  spec.terrain.dem = folder->path() / "terrain.tif";
  write_dem(source.terrain->dem(), spec.terrain.dem);
  return folder;
}

}  // namespace groundray::python
