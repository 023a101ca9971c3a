#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/dataset/shard.h"
#include "apps/groundray/record/dataset_writer.h"
#include "apps/groundray/run/frame_maker.h"
#include "apps/scene/simulation.h"

namespace groundray {

/// Work of a run, or of a shard of it.
struct FramePlan {
  /// Frames that are not finished, in the order of their making. All frames of each interval of
  /// 10 s are made before the next interval, so that the remaining frames take as long as the
  /// finished ones. Within an interval, frames are ordered by sensor, because its surroundings
  /// change little, with lidars first, because images may show their echoes.
  std::vector<FrameName> frames;
  std::size_t scans = 0, images = 0;  ///< total numbers, including finished frames
};

FramePlan plan_frames(const Simulation& simulation, const DatasetWriter& dataset,
                      const std::optional<Shard>& shard);

}  // namespace groundray
