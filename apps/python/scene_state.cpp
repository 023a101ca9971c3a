#include "apps/python/scene_state.h"

#include <algorithm>

namespace groundray::python {

FrameSceneCache::Key FrameSceneCache::key_of(const Exposed& frame) const {
  if (simulation_.terrain.whole() == nullptr) return {.X_DS = frame.X_DS, .begin = frame.begin};
  return {.p_DL = float_frame_origin(frame.X_DS->pose_at(frame.begin).translation_m)};
}

// Returns an entry with this key, or else an idle one, or else a new one.
FrameSceneCache::Entry& FrameSceneCache::entry_for(const Key& key) {
  const auto same = std::ranges::find(entries_, key, [](const auto& entry) { return entry->key; });
  if (same != entries_.end()) return **same;
  const auto idle = std::ranges::find(entries_, 0, [](const auto& entry) { return entry->users; });
  if (idle != entries_.end()) return **idle;
  return *entries_.emplace_back(std::make_unique<Entry>(simulation_));
}

std::shared_ptr<const Scene> FrameSceneCache::of(const Exposed& frame) {
  const std::lock_guard lock(mutex_);
  const Key key = key_of(frame);
  Entry& entry = entry_for(key);
  if (entry.key != key) {
    entry.key.reset();  // invalid while a scene is built
    entry.scene = &entry.frames(frame);
    entry.key = key;
  }
  ++entry.users;
  return {entry.scene, [this, &entry](const Scene*) { give_back(entry); }};
}

// Releases an entry. Of the idle entries, only the last one released is kept for the next frame.
void FrameSceneCache::give_back(Entry& entry) {
  const std::lock_guard lock(mutex_);
  --entry.users;
  if (entry.users > 0) return;
  std::erase_if(entries_,
                [&](const auto& each) { return each.get() != &entry && each->users == 0; });
}

}  // namespace groundray::python
