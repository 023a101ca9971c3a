#include "apps/view/rendering/eye_dome.h"

#include <vtkCameraPass.h>
#include <vtkEDLShading.h>
#include <vtkLightsPass.h>
#include <vtkNew.h>
#include <vtkOpaquePass.h>
#include <vtkOverlayPass.h>
#include <vtkRenderPassCollection.h>
#include <vtkSequencePass.h>
#include <vtkTranslucentPass.h>

#include <initializer_list>

namespace groundray {
namespace {

vtkSmartPointer<vtkSequencePass> in_sequence(std::initializer_list<vtkRenderPass*> passes) {
  const vtkNew<vtkRenderPassCollection> all;
  for (vtkRenderPass* const pass : passes) all->AddItem(pass);
  auto sequence = vtkSmartPointer<vtkSequencePass>::New();
  sequence->SetPasses(all);
  return sequence;
}

}  // namespace

vtkSmartPointer<vtkRenderPass> make_eye_dome_pass() {
  const vtkNew<vtkLightsPass> lights;
  const vtkNew<vtkOpaquePass> opaque;
  const vtkNew<vtkTranslucentPass> translucent;
  const vtkNew<vtkCameraPass> camera;
  camera->SetDelegatePass(in_sequence({lights.Get(), opaque.Get(), translucent.Get()}));
  const vtkNew<vtkEDLShading> shading;
  shading->SetDelegatePass(camera);
  const vtkNew<vtkOverlayPass> overlay;
  return in_sequence({shading.Get(), overlay.Get()});
}

}  // namespace groundray
