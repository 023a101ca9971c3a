#pragma once

#include <vtkRenderWindow.h>
#include <vtkSmartPointer.h>

#include <glm/vec2.hpp>

namespace groundray {

/// Returns a window that draws into memory. It needs neither display nor X server: it uses EGL
/// without a surface, and Mesa's llvmpipe if there is no graphics card.
/// @throws Error if the system has no such EGL, with the packages to install.
vtkSmartPointer<vtkRenderWindow> make_off_screen_window(glm::ivec2 size_px);

/// Returns true if the window was made by make_off_screen_window().
bool is_off_screen(vtkRenderWindow* window);

}  // namespace groundray
