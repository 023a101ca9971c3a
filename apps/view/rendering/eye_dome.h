#pragma once

#include <vtkRenderPass.h>
#include <vtkSmartPointer.h>

namespace groundray {

/// Returns the passes of a renderer that draws with eye-dome lighting: a pixel is darkened the more
/// its neighbours are nearer to the eye. Texts and legends are not.
/// @see Boucheny, Interactive scientific visualization of large datasets: towards a
/// perceptive-based
///      approach (2009), chapter 3.
vtkSmartPointer<vtkRenderPass> make_eye_dome_pass();

}  // namespace groundray
