#include "apps/python/frame_scenes.h"

#include <algorithm>

namespace groundray::python {

FrameScenes::Key FrameScenes::key_of(const Exposed& frame) const {
  if (world_.terrain.whole() == nullptr) return {.X_DS = frame.X_DS, .begin = frame.begin};
  return {.p_DL = float_frame_origin(frame.X_DS->pose_at(frame.begin).translation_m)};
}

// One with this key, or else an idle one, or else a new one.
FrameScenes::Entry& FrameScenes::entry_for(const Key& key) {
  const auto same = std::ranges::find(entries_, key, [](const auto& entry) { return entry->key; });
  if (same != entries_.end()) return **same;
  const auto idle = std::ranges::find(entries_, 0, [](const auto& entry) { return entry->users; });
  if (idle != entries_.end()) return **idle;
  return *entries_.emplace_back(std::make_unique<Entry>(world_));
}

std::shared_ptr<const Scene> FrameScenes::of(const Exposed& frame) {
  const std::lock_guard lock(mutex_);
  const Key key = key_of(frame);
  Entry& entry = entry_for(key);
  if (entry.key != key) {
    entry.key.reset();  // until there is one
    entry.scene = &entry.frames(frame);
    entry.key = key;
  }
  ++entry.users;
  return {entry.scene, [this, &entry](const Scene*) { give_back(entry); }};
}

// Of those that nobody uses, one stays for the next frame.
void FrameScenes::give_back(Entry& entry) {
  const std::lock_guard lock(mutex_);
  --entry.users;
  if (entry.users > 0) return;
  std::erase_if(entries_,
                [&](const auto& each) { return each.get() != &entry && each->users == 0; });
}

}  // namespace groundray::python
