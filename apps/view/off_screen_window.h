#pragma once

#include <vtkRenderWindow.h>
#include <vtkSmartPointer.h>

#include <glm/vec2.hpp>

namespace groundray {

/// Returns a window that is drawn into memory alone: it needs neither display nor X server (EGL
/// without a surface; Mesa's llvmpipe where there is no graphics card).
/// @throws Error if the system has no such EGL, with what to install.
vtkSmartPointer<vtkRenderWindow> make_off_screen_window(glm::ivec2 size_px);

/// Whether a window is one of these.
bool is_off_screen(vtkRenderWindow* window);

}  // namespace groundray
