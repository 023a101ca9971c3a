#include "reconstruction/dem/fill/sight_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/error.h"
#include "reconstruction/dem/plan_triangle.h"

namespace groundray {
namespace {

bool is_finite(const glm::dvec3& p) { return std::isfinite(p.x + p.y + p.z); }

void check_sight_lines(const GridFrame& frame, const OcclusionFaces& faces,
                       std::span<const SightLine> lines, double margin_m) {
  Violations broken("bounds by lines of sight");
  broken.unless(frame.samples.x >= 1 && frame.samples.y >= 1, "samples = [{}, {}] must be positive",
                frame.samples.x, frame.samples.y);
  const double area_m2 = frame.step_m.x * frame.step_m.y;
  broken.unless(std::isfinite(area_m2) && area_m2 != 0,
                "step_m = [{}, {}] must be finite and not zero", frame.step_m.x, frame.step_m.y);
  broken.unless(margin_m >= 0 && std::isfinite(margin_m), "margin_m = {} must be 0 or more",
                margin_m);
  const auto& vertices_m = faces.shape.vertices_m;
  broken.unless(faces.origins_m.size() == vertices_m.size(),
                "occlusion faces have {} vertices and {} origins; each vertex needs one origin",
                vertices_m.size(), faces.origins_m.size());
  const auto is_odd = [&](const glm::uvec3& t) {
    return std::max({t.x, t.y, t.z}) >= vertices_m.size();
  };
  const auto odd = std::ranges::find_if(faces.shape.triangles, is_odd);
  broken.unless(odd == faces.shape.triangles.end(),
                "occlusion face {} refers to a vertex that does not exist",
                odd - faces.shape.triangles.begin());
  const bool is_good =
      std::ranges::all_of(vertices_m, is_finite) && std::ranges::all_of(faces.origins_m, is_finite);
  broken.unless(is_good, "a vertex or origin of the occlusion faces is not finite; remove it");
  const auto lost = std::ranges::find_if(lines, [](const SightLine& line) {
    return !is_finite(line.origin_m) || !is_finite(line.end_m);
  });
  broken.unless(lost == lines.end(), "line of sight {} is not finite; remove it",
                lost - lines.begin());
  broken.throw_if_any();
}

// Lowest bound so far of each sample.
class Bounds {
 public:
  Bounds(const GridFrame& frame, double margin_m)
      : frame_(frame),
        margin_m_(margin_m),
        least_m_(
            static_cast<std::size_t>(frame.samples.x) * static_cast<std::size_t>(frame.samples.y),
            std::numeric_limits<float>::quiet_NaN()) {}

  void lower(int column, int row, double height_m) {
    float& least_m =
        least_m_[static_cast<std::size_t>(row) * static_cast<std::size_t>(frame_.samples.x) +
                 static_cast<std::size_t>(column)];
    const double bound_m = height_m + margin_m_;
    if (bound_m >= double{least_m}) return;
    least_m = static_cast<float>(bound_m);
    if (least_m < bound_m)
      least_m = std::nextafter(least_m, std::numeric_limits<float>::infinity());
  }

  void lower(const std::array<glm::dvec3, 3>& triangle_m) {
    visit_samples(frame_, triangle_m,
                  [this](int column, int row, double height_m) { lower(column, row, height_m); });
  }

  void lower(const SightLine& line);

  std::vector<float> take() { return std::move(least_m_); }

 private:
  const GridFrame& frame_;
  double margin_m_;
  std::vector<float> least_m_;
};

// Lowers the bounds of samples within half a cell of a line: at most two for each step along it.
void Bounds::lower(const SightLine& line) {
  const glm::dvec2 a = frame_.to_grid(glm::dvec2(line.origin_m));
  const glm::dvec2 along = frame_.to_grid(glm::dvec2(line.end_m)) - a;
  const double length2 = along.x * along.x + along.y * along.y;
  if (length2 == 0) return;
  const int main = std::abs(along.x) >= std::abs(along.y) ? 0 : 1;
  double begin = 0, end = 1;
  for (const int k : {0, 1}) clip_range(a[k], along[k], -1, frame_.samples[k], begin, end);
  if (begin > end) return;
  const auto [low, high] =
      std::minmax({a[main] + begin * along[main], a[main] + end * along[main]});
  const int first = std::max(static_cast<int>(std::floor(low)), 0);
  const int last = std::min(static_cast<int>(std::ceil(high)), frame_.samples[main] - 1);
  for (int step = first; step <= last; ++step) {
    const double aside = a[1 - main] + (step - a[main]) * along[1 - main] / along[main];
    const int near = static_cast<int>(std::floor(aside));
    for (int other = std::max(near, 0); other <= std::min(near + 1, frame_.samples[1 - main] - 1);
         ++other) {
      const glm::dvec2 sample = main == 0 ? glm::dvec2(step, other) : glm::dvec2(other, step);
      const glm::dvec2 off = sample - a;
      const double t = (off.x * along.x + off.y * along.y) / length2;
      const double across = off.x * along.y - off.y * along.x;
      if (t < 0 || t > 1 || across * across > 0.25 * length2) continue;
      lower(static_cast<int>(sample.x), static_cast<int>(sample.y),
            line.origin_m.z + t * (line.end_m.z - line.origin_m.z));
    }
  }
}

}  // namespace

std::vector<float> sight_bound(const GridFrame& frame, const OcclusionFaces& faces,
                               std::span<const SightLine> lines, double margin_m) {
  check_sight_lines(frame, faces, lines, margin_m);
  Bounds bounds(frame, margin_m);
  const auto& vertices_m = faces.shape.vertices_m;
  for (const glm::uvec3& t : faces.shape.triangles) {
    bounds.lower({vertices_m[t.x], vertices_m[t.y], vertices_m[t.z]});
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      bounds.lower({faces.origins_m[a], vertices_m[a], vertices_m[b]});
      if (faces.origins_m[a] != faces.origins_m[b])
        bounds.lower({faces.origins_m[a], faces.origins_m[b], vertices_m[b]});
    }
  }
  for (const SightLine& line : lines) bounds.lower(line);
  return bounds.take();
}

}  // namespace groundray
