#pragma once

#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include <filesystem>
#include <string>

#include "apps/view/layer.h"
#include "core/image.h"

namespace groundray {

/// Returns the flat layer of a picture: a pixel is a metre wide; its columns run along x, its last
/// row lies at y = 0.
Layer picture_layer(const std::string& name, const Image8& picture);

/// Returns an image as a texture whose first row is uppermost, v = 1.
/// @param image  of 1 to 4 channels.
vtkSmartPointer<vtkTexture> make_texture(const Image8& image);

/// Returns light as a picture: exposed so that all but the lightest 1 in 200 can be told apart.
/// What is no number is black.
Image8 expose(const ImageF& light);

/// Gives data texture coordinates, two for each point.
void set_texture_places(vtkPolyData& data, std::span<const glm::vec2> places);

}  // namespace groundray
