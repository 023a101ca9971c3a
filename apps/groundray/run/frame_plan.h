#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/dataset/shard.h"
#include "apps/groundray/record/dataset.h"
#include "apps/groundray/run/frame_maker.h"
#include "apps/scene/world.h"

namespace groundray {

/// What a run, or a shard of it, has to do.
struct FramePlan {
  /// The frames that are not there yet. Every 10 s of the run's time are made as a whole, so that
  /// what is left takes as long a frame as what is done; in them one sensor after the other, for
  /// what it meets changes little, and lidars first, for images may show their echoes.
  std::vector<FrameName> frames;
  std::size_t scans = 0, images = 0;  ///< of all, those that are there included
};

FramePlan plan_frames(const World& world, const Dataset& dataset,
                      const std::optional<Shard>& shard);

}  // namespace groundray
