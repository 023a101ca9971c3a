#include "apps/dataset/write/boxes.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <iterator>
#include <vector>

#include "core/io/npy_io.h"

namespace groundray {
namespace {

static_assert(std::endian::native == std::endian::little);

// Bytes of the rows of a structured array.
class RowBytes {
 public:
  template <typename... T>
  void add(const T&... values) {
    (add_one(values), ...);
  }
  void add(const glm::dvec3& vector) { add(vector.x, vector.y, vector.z); }
  void add(const PixelBox& box) { add(box.low.x, box.low.y, box.high.x, box.high.y); }
  std::span<const std::byte> all() const { return bytes_; }

 private:
  template <typename T>
  void add_one(const T& value) {
    const auto part = std::as_bytes(std::span(&value, 1));
    bytes_.insert(bytes_.end(), part.begin(), part.end());
  }

  std::vector<std::byte> bytes_;
};

// Fields of every box, after those that differ.
constexpr NpyField box_fields[] = {
    {"instance", "<u4"}, {"label", "<u2"},  {"time_s", "<f8"},   {"x_m", "<f8"},
    {"y_m", "<f8"},      {"z_m", "<f8"},    {"length_m", "<f8"}, {"width_m", "<f8"},
    {"height_m", "<f8"}, {"qx", "<f8"},     {"qy", "<f8"},       {"qz", "<f8"},
    {"qw", "<f8"},       {"vx_m_s", "<f8"}, {"vy_m_s", "<f8"},   {"vz_m_s", "<f8"}};

std::vector<NpyField> fields_with(std::initializer_list<NpyField> more) {
  std::vector<NpyField> fields(std::begin(box_fields), std::end(box_fields));
  fields.insert(fields.end(), more);
  return fields;
}

void add_box(const InstanceBox& box, const SceneObjects& objects, std::chrono::nanoseconds stamp,
             RowBytes& into) {
  const std::uint32_t first = objects.objects.parts_of(box.instance).first;
  const std::uint16_t label = objects.models[objects.objects.model_of(first)].label;
  into.add(box.instance, label, in_seconds(box.time - stamp));
  into.add(box.p_DB);
  into.add(box.size_m);
  into.add(box.R_DB.x, box.R_DB.y, box.R_DB.z, box.R_DB.w);
  into.add(box.velocity_m_s);
}

}  // namespace

void write_boxes(const std::filesystem::path& path, const SceneObjects& objects,
                 std::span<const ScannedInstance> instances, std::chrono::nanoseconds stamp) {
  RowBytes rows;
  for (const auto& [box, points] : instances) {
    add_box(box, objects, stamp, rows);
    rows.add(points);
  }
  write_npy(path, fields_with({{"points", "<u4"}}), instances.size(), rows.all());
}

void write_boxes(const std::filesystem::path& path, const SceneObjects& objects,
                 std::span<const ImagedInstance> instances, std::chrono::nanoseconds stamp) {
  RowBytes rows;
  for (const ImagedInstance& each : instances) {
    add_box(each.box, objects, stamp, rows);
    rows.add(each.pixels);
    rows.add(each.visible);
    rows.add(each.alone);
    rows.add(each.whole);
    rows.add(each.visible_share, each.truncated_share);
  }
  write_npy(path,
            fields_with({{"pixels", "<u4"},
                         {"visible_u_min", "<i4"},
                         {"visible_v_min", "<i4"},
                         {"visible_u_max", "<i4"},
                         {"visible_v_max", "<i4"},
                         {"alone", "<u4"},
                         {"alone_u_min", "<i4"},
                         {"alone_v_min", "<i4"},
                         {"alone_u_max", "<i4"},
                         {"alone_v_max", "<i4"},
                         {"visible_share", "<f8"},
                         {"truncated_share", "<f8"}}),
            instances.size(), rows.all());
}

}  // namespace groundray
