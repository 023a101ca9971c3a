#include "terrain/assets/figure.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/error.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/figure_rig.h"
#include "terrain/assets/figure_walker.h"

namespace groundray {
namespace {

// Skeleton and parts of a kind that walks, both of unit size.
struct Figure {
  FigureRig (*make_rig)(const AssetShape& shape);
  Model (*make_part)(const AssetShape& shape, std::size_t part);
};

std::optional<Figure> figure_of(AssetKind kind) {
  if (kind == AssetKind::Person) return Figure{person_rig, make_person_part};
  if (kind == AssetKind::Deer) return Figure{deer_rig, make_deer_part};
  return std::nullopt;
}

Model standing_figure(AssetKind kind, const AssetShape& shape) {
  AssetBuilder builder;
  const auto figure = figure_of(kind);
  const std::vector<Pose> poses = standing_pose(figure->make_rig(shape));
  for (std::size_t i = 0; i < poses.size(); ++i)
    builder.append(figure->make_part(shape, i), poses[i]);
  return builder.take();
}

}  // namespace

Model make_person(AssetShape shape) {
  AssetBuilder builder;
  const Model person = standing_figure(AssetKind::Person, shape);
  builder.append(person, Pose());
  builder.scale(shape.size_m / bounds_of(person.mesh).high_m.z);
  return builder.take();
}

Model make_deer(AssetShape shape) {
  AssetBuilder builder;
  builder.append(standing_figure(AssetKind::Deer, shape), Pose());
  builder.scale(shape.size_m);
  return builder.take();
}

std::size_t figure_parts(AssetKind kind) {
  const auto figure = figure_of(kind);
  return figure ? figure->make_rig(asset_shape({.kind = kind})).parts : 0;
}

Model make_figure_part(const AssetSpec& spec, std::size_t part) {
  const AssetShape shape = asset_shape(spec);
  AssetBuilder builder;
  builder.append(figure_of(spec.kind)->make_part(shape, part), Pose());
  builder.scale(shape.size_m);
  return builder.take();
}

std::vector<Trajectory> walk(const GroundHeight& ground, const WalkSpec& spec,
                             const Trajectory& X_DO) {
  const AssetShape shape = asset_shape(spec.asset);
  const auto figure = figure_of(spec.asset.kind);
  if (!figure) throw Error("a {} does not walk", asset_name(spec.asset.kind));
  if (spec.spacing.count() <= 0)
    throw Error("spacing = {} ns of the poses must be positive", spec.spacing.count());
  FigureRig rig = scaled(figure->make_rig(shape), shape.size_m);
  std::vector<std::vector<Trajectory::Sample>> samples(rig.parts);
  FigureWalker walker(ground, spec, std::move(rig), X_DO);
  const auto begin = std::clamp(spec.from, X_DO.begin_time(), X_DO.end_time());
  const auto end = std::clamp(spec.until, begin, X_DO.end_time());
  for (std::chrono::nanoseconds time = begin;; time += spec.spacing) {
    time = std::min(time, end);
    const std::vector<Pose> poses = walker.pose_at(time);
    for (std::size_t i = 0; i < poses.size(); ++i) samples[i].push_back({time, poses[i]});
    if (time == end) break;
  }
  std::vector<Trajectory> paths;
  for (auto& of_part : samples) paths.emplace_back(std::move(of_part));
  return paths;
}

}  // namespace groundray
