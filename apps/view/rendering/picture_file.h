#pragma once

#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include <filesystem>
#include <glm/vec2.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "apps/view/rendering/layer.h"
#include "core/image/image.h"

namespace groundray {

/// Picture in displayable form.
struct PictureFile {
  Image8 picture;                  ///< 1 to 4 channels, at an exposure of 0 EV
  std::vector<std::string> notes;  ///< messages on what part of the file is shown, and in what way
  ImageF light{};  ///< linear light, 1 is white at 0 EV; empty if the file has sRGB values
  bool has_exposure = true;  ///< false for colours that represent numbers
};

/// Reads a picture. PNG and JPEG are unchanged; linear light (OpenEXR, Radiance) is exposed so that
/// 1 % of its positive values exceed white; an OpenEXR file without colours is shown by one channel
/// in viridis; a TIFF by its first three bands.
/// @throws Error as the readers of these, or if there is no channel to show.
PictureFile read_picture(const std::filesystem::path& path);

/// Converts linear light, of which 1 is white at 0 EV, to a picture. NaN and infinite values are
/// black.
/// @param exposure_ev  brightens by this power of 2.
Image8 expose(const ImageF& light, double exposure_ev);

/// Brightens an sRGB picture by a power of 2 in linear light; an alpha channel, the second of 2 or
/// the fourth of 4, stays as it is.
Image8 expose(const Image8& picture, double exposure_ev);

/// Returns an image as a texture; its first row is at v = 1.
/// @param image  of 1 to 4 channels.
vtkSmartPointer<vtkTexture> make_texture(const Image8& image);

/// Returns a texture that modulates colours, with unfiltered texels.
/// @param image  of 4 channels; alpha is 0 or 255.
vtkSmartPointer<vtkTexture> make_mask(const Image8& image);

/// Sets the texture coordinates of the data, one pair for each point.
void set_texture_coordinates(vtkPolyData& data, std::span<const glm::vec2> places);

/// Returns a flat layer of a picture: a pixel is 1 m wide, columns run along x, and the last row
/// lies at y = 0. View::set_exposure applies to it if the picture has an exposure.
Layer picture_layer(const std::string& name, const std::shared_ptr<const PictureFile>& file);

}  // namespace groundray
