#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "apps/dataset/write/preview.h"
#include "apps/python/binding/arrays.h"
#include "apps/python/binding/bind.h"
#include "apps/python/binding/numpy_argument.h"
#include "apps/python/binding/pickle.h"
#include "apps/python/camera_image.h"
#include "core/image/exr_io.h"
#include "core/image/image.h"
#include "core/image/png_io.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;

std::vector<std::string> names_of(const CameraImage& image) {
  std::vector<std::string> names;
  for (const CameraImage::Channel& channel : image.channels) names.push_back(channel.name);
  return names;
}

AnyArray channel_of(nb::handle_t<CameraImage> self, const std::string& name) {
  const auto& image = nb::cast<const CameraImage&>(self);
  const auto found = std::ranges::find(image.channels, name, &CameraImage::Channel::name);
  if (found == image.channels.end()) {
    const std::string text = fmt::format("there is no channel '{}'; the camera's products are {}",
                                         name, fmt::join(names_of(image), ", "));
    throw nb::key_error(text.c_str());
  }
  return std::visit(
      [&](const auto& pixels) {
        const auto height = static_cast<std::size_t>(pixels.height());
        const auto width = static_cast<std::size_t>(pixels.width());
        const auto depth = static_cast<std::size_t>(pixels.channels());
        if (depth == 1 && name != "coverage")
          return view(pixels.values().data(), {height, width}, self);
        return view(pixels.values().data(), {height, width, depth}, self);
      },
      found->pixels);
}

// Linear RGB that Python gives, height x width x 3.
using GivenPicture =
    nb::ndarray<const float, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu, nb::ro>;

ImageF image_of(const GivenPicture& pixels) {
  ImageF image(static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)), 3);
  std::copy_n(pixels.data(), pixels.size(), image.values().begin());
  return image;
}

void bind_writers(nb::module_& module) {
  module.def(
      "write_radiance_png",
      [](const std::filesystem::path& path, const GivenPicture& radiance,
         const GivenPicture& exposed_for) {
        write_png(path, draw_radiance(image_of(radiance), image_of(exposed_for)));
      },
      "path"_a, "radiance"_a, "exposed_for"_a,
      "Writes linear RGB, height x width x 3, as a PNG file with the brightness that the preview "
      "of `exposed_for` has.");
  module.def(
      "write_rgb_exr",
      [](const std::filesystem::path& path, const GivenPicture& rgb,
         const std::map<std::string, std::string>& attributes) {
        std::vector<ExrAttribute> header;
        for (const auto& [name, text] : attributes) header.push_back({name, text});
        const ImageF image = image_of(rgb);
        write_exr(path, {{{"R", "G", "B"}, &image}}, header);
      },
      "path"_a, "rgb"_a, "attributes"_a,
      "Writes linear RGB, height x width x 3, as an OpenEXR file with attributes of text.");
}

}  // namespace

void bind_image(nb::module_& module) {
  nb::class_<CameraImage> type(module, "Image", R"(One image of a camera: channels of equal size.

image["depth_m"] is a channel as a NumPy array, height x width or height x width x n, a
read-only view that keeps the image alive. dict(image) is a dict of all channels.)");
  add_pickling(type, "image",
               [](nb::handle self) { return state_of(nb::handle_t<CameraImage>(self)); });
  bind_writers(module);
  module.def("restore_image", &restored_image, "state"_a);
  type.def("__getitem__", &channel_of, "name"_a, "The channel of this name: a view.")
      .def("__len__", [](const CameraImage& image) { return image.channels.size(); })
      .def(
          "__contains__",
          [](const CameraImage& image, const std::string& name) {
            const std::vector<std::string> names = names_of(image);
            return std::ranges::find(names, name) != names.end();
          },
          "name"_a)
      .def(
          "__iter__", [](const CameraImage& image) { return nb::iter(nb::cast(names_of(image))); },
          nb::sig("def __iter__(self) -> collections.abc.Iterator[str]"),
          "Iterates over the names of the channels.")
      .def(
          "keys", [](const CameraImage& image) { return names_of(image); },
          "The names of the channels.")
      .def_prop_ro(
          "labels", [](const CameraImage& image) { return image.labels; },
          "Classes of the layers of `coverage`; 0 is the sky.")
      .def_ro("frame", &CameraImage::frame, "The image's number, from 0.")
      .def_prop_ro(
          "t_s", [](const CameraImage& image) { return seconds_of(image.begin); },
          "When the exposure of its first row began, in seconds of the scene's time.")
      .def_prop_ro("sensor", [](const CameraImage& image) { return image.sensor; })
      .def_prop_ro(
          "exposure_s", [](const CameraImage& image) { return image.exposure.exposure_s; },
          "Exposure time of its light, which may be automatic; 0 without light.")
      .def_prop_ro(
          "gain", [](const CameraImage& image) { return image.exposure.gain; },
          "Factor of the imager's gain, 1 or more.")
      .def_ro("saturated_share", &CameraImage::saturated_share,
              "Fraction of its pixels that are saturated; None without an imager.")
      .def("__repr__", [](const CameraImage& image) {
        return fmt::format("<Image {} of camera '{}': {}>", image.frame, image.sensor,
                           fmt::join(names_of(image), ", "));
      });
}

}  // namespace groundray::python
