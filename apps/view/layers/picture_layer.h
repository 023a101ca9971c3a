#pragma once

#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include <filesystem>
#include <string>

#include "apps/view/rendering/layer.h"
#include "core/image/image.h"

namespace groundray {

/// Returns a flat layer of a picture: a pixel is 1 m wide, columns run along x, and the last row
/// lies at y = 0.
Layer picture_layer(const std::string& name, const Image8& picture);

/// Returns an image as a texture; its first row is at v = 1.
/// @param image  of 1 to 4 channels.
vtkSmartPointer<vtkTexture> make_texture(const Image8& image);

/// Converts linear light to a picture, exposed so that all but the brightest 0.5 % of the pixels
/// remain distinguishable. NaN and infinite values are black.
Image8 expose(const ImageF& light);

/// Sets the texture coordinates of the data, one pair for each point.
void set_texture_places(vtkPolyData& data, std::span<const glm::vec2> places);

}  // namespace groundray
