#include "sensors/camera/image_boxes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <utility>

namespace groundray {
namespace {

using std::chrono::nanoseconds;

constexpr int most_beside = 65000;  // positions beside the image that are traced
constexpr int face_steps = 8;       // of the lattice on each face of a box that is projected

// Pixels of an image that show an instance.
struct Shown {
  PixelBox box;
  std::uint32_t pixels = 0;
  std::int64_t sum_of_rows = 0;
};

std::map<std::uint32_t, Shown> shown_in(const Image32& instances) {
  std::map<std::uint32_t, Shown> shown;
  for (int y = 0; y < instances.height(); ++y) {
    for (int x = 0; x < instances.width(); ++x) {
      const std::uint32_t instance = instances.at(x, y)[0];
      if (instance == 0) continue;
      Shown& of = shown[instance];
      of.box.add({x, y});
      ++of.pixels;
      of.sum_of_rows += y;
    }
  }
  return shown;
}

PixelBox intersection(const PixelBox& a, const PixelBox& b) noexcept {
  return {glm::max(a.low, b.low), glm::min(a.high, b.high)};
}

PixelBox widened(const PixelBox& box, int by) noexcept { return {box.low - by, box.high + by}; }

bool contains(const PixelBox& box, glm::ivec2 pixel) noexcept {
  return box.low.x <= pixel.x && pixel.x <= box.high.x && box.low.y <= pixel.y &&
         pixel.y <= box.high.y;
}

std::int64_t area(const PixelBox& box) noexcept {
  const glm::ivec2 size = glm::max(box.high - box.low + 1, glm::ivec2(0));
  return std::int64_t{size.x} * size.y;
}

// Traces one instance alone through positions of an image.
class Silhouette {
 public:
  Silhouette(const Camera& camera, const Trajectory& X_DC, nanoseconds begin, ObjectTracer object)
      : camera_(camera),
        X_DC_(X_DC),
        begin_(begin),
        object_(std::move(object)),
        size_(camera.spec().size_px) {}

  // Adds the pixels of a rectangle that show it.
  void add_inside(const PixelBox& region, ImagedInstance& into) {
    for (int y = region.low.y; y <= region.high.y; ++y) {
      trace_row(y, region.low.x, region.high.x, 1, [&](int x) {
        ++into.alone;
        into.whole.add({x, y});
      });
    }
  }

  // Returns the number of pixels beside the image, in a rectangle, that would show it.
  double beside(const PixelBox& region) {
    const PixelBox image{{0, 0}, size_ - 1};
    const auto step = static_cast<int>(
        std::ceil(std::sqrt(static_cast<double>(area(region)) / static_cast<double>(most_beside))));
    double count = 0;
    for (int y = region.low.y + step / 2; y <= region.high.y; y += step) {
      trace_row(y, region.low.x + step / 2, region.high.x, step, [&](int x) {
        if (!contains(image, {x, y})) count += static_cast<double>(step) * step;
      });
    }
    return count;
  }

 private:
  // Calls `found` for each column, of every step-th one, whose ray hits the object.
  template <typename Found>
  void trace_row(int y, int first, int last, int step, const Found& found) {
    const nanoseconds time = begin_ + camera_.middle_of(std::clamp(y, 0, size_.y - 1));
    const Pose X_DC = X_DC_.pose_at(time);
    rays_.clear();
    columns_.clear();
    for (int x = first; x <= last; x += step) {
      const glm::dvec3 direction = direction_of({x, y});
      if (direction == glm::dvec3(0)) continue;
      rays_.push_back({X_DC.translation_m, X_DC.rotation * direction,
                       std::numeric_limits<double>::infinity(), time});
      columns_.push_back(x);
    }
    hits_.assign(rays_.size(), Hit{});
    object_.trace(rays_, hits_);
    for (std::size_t i = 0; i < hits_.size(); ++i)
      if (hits_[i]) found(columns_[i]);
  }

  glm::dvec3 direction_of(glm::ivec2 pixel) const {
    if (contains({{0, 0}, size_ - 1}, pixel))
      return camera_
          .directions()[static_cast<std::size_t>(pixel.y) * static_cast<std::size_t>(size_.x) +
                        static_cast<std::size_t>(pixel.x)];
    const auto ray = camera_.lens().ray(glm::dvec2(pixel));
    return ray ? ray->direction : glm::dvec3(0);
  }

  const Camera& camera_;
  const Trajectory& X_DC_;
  nanoseconds begin_;
  ObjectTracer object_;
  glm::ivec2 size_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<int> columns_;
};

// Returns points of the unit cube's faces, on a lattice.
std::vector<glm::dvec3> face_points() {
  std::vector<glm::dvec3> points;
  constexpr int last = face_steps;
  for (int i = 0; i <= last; ++i) {
    for (int j = 0; j <= last; ++j) {
      const bool is_edge = i == 0 || i == last || j == 0 || j == last;
      for (int k = 0; k <= last; k += is_edge ? 1 : last)
        points.push_back(glm::dvec3(i, j, k) / double{last} - 0.5);
    }
  }
  return points;
}

// Returns the rectangle of the images of a box's faces; nullopt if the lens does not image them
// all.
std::optional<PixelBox> projected(const InstanceBox& box, const Camera& camera, const Pose& X_DC) {
  static const std::vector<glm::dvec3> points = face_points();
  PixelBox region;
  const glm::dquat R_CD = glm::conjugate(X_DC.rotation);
  for (const glm::dvec3& point : points) {
    const glm::dvec3 p_D = box.p_DB + box.R_DB * (point * box.size_m);
    const auto pixel = camera.lens().project(R_CD * (p_D - X_DC.translation_m));
    if (!pixel) return std::nullopt;
    region.add(glm::ivec2(glm::clamp(*pixel, -1e6, 1e6)));
  }
  return region;
}

// Returns true if the camera is in the box, whose faces then surround it.
bool surrounds(const InstanceBox& box, const glm::dvec3& p_D) noexcept {
  const glm::dvec3 p_B = glm::conjugate(box.R_DB) * (p_D - box.p_DB);
  return glm::all(glm::lessThanEqual(glm::abs(p_B), 0.5 * box.size_m + 1e-3));
}

// Returns a rectangle that contains the images of an instance's box at the times of all rows;
// nullopt if the lens does not image all of it, or the box surrounds the camera.
std::optional<PixelBox> where_shown(const Camera& camera, const InstanceBoxes& boxes,
                                    const Trajectory& X_DC, nanoseconds begin,
                                    std::uint32_t instance, const Shown& shown) {
  constexpr int times = 5;  // between these, the box moves nearly uniformly in the image
  const double last_row = camera.spec().size_px.y - 1;
  PixelBox region = shown.box;
  for (int i = 0; i < times; ++i) {
    const nanoseconds time = begin + camera.middle_of(last_row * i / (times - 1));
    const InstanceBox box = boxes.at(instance, time);
    const Pose X_DC_then = X_DC.pose_at(time);
    if (surrounds(box, X_DC_then.translation_m)) return std::nullopt;
    const auto faces = projected(box, camera, X_DC_then);
    if (!faces) return std::nullopt;
    region.add(faces->low);
    region.add(faces->high);
    if (camera.middle_of(last_row) == camera.middle_of(0)) break;  // a global shutter
  }
  return region;
}

// Measures one instance.
ImagedInstance imaged(const Camera& camera, const Scene& scene, const InstanceBoxes& boxes,
                      const Trajectory& X_DC, nanoseconds begin, std::uint32_t instance,
                      const Shown& shown) {
  const glm::ivec2 size = camera.spec().size_px;
  const PixelBox image{{0, 0}, size - 1};
  const PixelBox around{-size / 2, size + size / 2 - 1};
  const double row = static_cast<double>(shown.sum_of_rows) / shown.pixels;
  ImagedInstance measured;
  measured.box = boxes.at(instance, begin + camera.middle_of(row));
  measured.pixels = shown.pixels;
  measured.visible = shown.box;
  const auto region = where_shown(camera, boxes, X_DC, begin, instance, shown);
  const PixelBox searched = region ? intersection(widened(*region, 2), around) : around;
  Silhouette silhouette(camera, X_DC, begin, scene.objects.only(instance));
  for (PixelBox inside = intersection(searched, image);;) {
    measured.alone = 0;
    measured.whole = {};
    silhouette.add_inside(inside, measured);
    // A lens that bends faces may show more than the lattice on them.
    const PixelBox due = intersection(widened(measured.whole, 1), image);
    if (measured.alone == 0 || (contains(inside, due.low) && contains(inside, due.high))) break;
    inside = intersection(widened(inside, std::max(8, (inside.high.x - inside.low.x) / 4)), image);
  }
  const double beside = silhouette.beside(searched);
  if (measured.alone > 0)
    measured.visible_share = std::min(1.0, static_cast<double>(measured.pixels) / measured.alone);
  measured.truncated_share = beside / (beside + std::max(measured.alone, measured.pixels));
  return measured;
}

}  // namespace

void PixelBox::add(glm::ivec2 pixel) noexcept {
  const bool is_empty = high.x < low.x;
  low = is_empty ? pixel : glm::min(low, pixel);
  high = is_empty ? pixel : glm::max(high, pixel);
}

std::vector<ImagedInstance> imaged_instances(const Camera& camera, const Scene& scene,
                                             const InstanceBoxes& boxes, const Trajectory& X_DC,
                                             nanoseconds begin, const ImageTruth& truth,
                                             const std::function<void()>& check) {
  camera.check_cover(X_DC, begin);
  const std::map<std::uint32_t, Shown> shown = shown_in(truth.instance);
  const std::vector<std::pair<std::uint32_t, Shown>> all(shown.begin(), shown.end());
  std::vector<ImagedInstance> measured(all.size());
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    if (check) check();
    measured[i] = imaged(camera, scene, boxes, X_DC, begin, all[i].first, all[i].second);
  });
  return measured;
}

}  // namespace groundray
