#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkObject.h>
#include <vtkOpenGLState.h>

#include <array>

#include "apps/view/rendering/view.h"
#include "core/error.h"

namespace groundray {
namespace {

constexpr unsigned less_or_equal = 0x0203;  // GL_LEQUAL

[[noreturn]] void throw_no_egl(const char* what) {
  throw Error(
      "cannot draw without a display: {} (EGL error {:#x}); pictures need EGL and a driver that "
      "draws without a surface: on Debian install libegl1 and libgl1-mesa-dri",
      what, static_cast<unsigned>(eglGetError()));
}

EGLDisplay open_display() {
  const auto* const extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto platform_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (extensions == nullptr || platform_display == nullptr) throw_no_egl("EGL is too old");
  EGLDisplay const display =
      platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) == EGL_FALSE)
    throw_no_egl("EGL cannot be initialised");
  return display;
}

EGLContext make_context(EGLDisplay display) {
  constexpr std::array<EGLint, 5> wanted = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                            EGL_OPENGL_BIT, EGL_NONE};
  constexpr std::array<EGLint, 5> version = {EGL_CONTEXT_MAJOR_VERSION, 3,
                                             EGL_CONTEXT_MINOR_VERSION, 2, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint found = 0;
  eglBindAPI(EGL_OPENGL_API);
  if (eglChooseConfig(display, wanted.data(), &config, 1, &found) == EGL_FALSE || found == 0)
    throw_no_egl("EGL does not support OpenGL");
  EGLContext const context = eglCreateContext(display, config, EGL_NO_CONTEXT, version.data());
  if (context == EGL_NO_CONTEXT) throw_no_egl("OpenGL 3.2 is not available");
  return context;
}

// VTK's window for external contexts, with an EGL context of its own.
class OffScreenWindow final : public vtkGenericOpenGLRenderWindow {
 public:
  static OffScreenWindow* New() {
    auto* const window = new OffScreenWindow;
    window->InitializeObjectBase();
    return window;
  }

  void open() {
    display_ = open_display();
    context_ = make_context(display_);
    MakeCurrent();
    SetOwnContext(0);
    SetMapped(1);
    SetReadyForRendering(true);
    SetSupportsOpenGL(1);
    SetMultiSamples(0);
    // VTK's OpenGL loader queries an X server after it has loaded all functions. Without one, VTK
    // would report failure at every frame; hence the flags are set here.
    const auto shown = vtkObject::GetGlobalWarningDisplay();
    vtkObject::SetGlobalWarningDisplay(0);
    OpenGLInit();
    vtkObject::SetGlobalWarningDisplay(shown);
    GlewInitValid = true;
    Initialized = true;
    OpenGLInit();
    // VTK adopts the state of an external context, but requires this depth function.
    GetState()->Reset();
    GetState()->vtkglDepthFunc(less_or_equal);
  }

  void MakeCurrent() override {
    if (context_ != EGL_NO_CONTEXT)
      eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_);
  }
  bool IsCurrent() override {
    return context_ != EGL_NO_CONTEXT && eglGetCurrentContext() == context_;
  }

 protected:
  ~OffScreenWindow() override {
    if (context_ == EGL_NO_CONTEXT) return;
    MakeCurrent();
    Finalize();
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
    context_ = EGL_NO_CONTEXT;
  }

 private:
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

vtkSmartPointer<vtkRenderWindow> make_offscreen_window(glm::ivec2 size_px) {
  const auto window = vtkSmartPointer<OffScreenWindow>::Take(OffScreenWindow::New());
  window->open();
  window->SetSize(size_px.x, size_px.y);
  return window;
}

bool is_offscreen(vtkRenderWindow* window) {
  return dynamic_cast<OffScreenWindow*>(window) != nullptr;
}

}  // namespace groundray
