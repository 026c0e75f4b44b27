// OpenGL contexts in which MuJoCo draws without a window.
#pragma once

#include <memory>

namespace walker::mujoco {

/// An OpenGL context without a surface; MuJoCo adds an off-screen buffer.
///
/// A thread has one current context, and the caller's may be that of a window or another renderer.
/// Each use therefore runs in a new thread.
class OffscreenContext {
 public:
  OffscreenContext() = default;
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;
  virtual ~OffscreenContext() = default;

  /// @throws std::runtime_error
  virtual void make_current() = 0;
  virtual void release() noexcept = 0;
};

/// Creates a context of EGL (hardware or software) or, if EGL does not work, of OSMesa (software).
/// The environment variable MUJOCO_GL, which MuJoCo's and Gymnasium's renderers read too, restricts
/// the choice to `egl` or `osmesa`; any other value has no effect. The first choice holds for the
/// whole process.
/// @throws std::runtime_error listing what was tried and what to install; as
/// `refuse_pictures_in_fork`
std::unique_ptr<OffscreenContext> make_offscreen_context();

/// Whether this process is the child of a fork whose parent had created a context. OpenGL's threads
/// and locks belong to the parent, so a call would block forever.
bool has_drawn_before_fork();

/// @throws std::runtime_error if `has_drawn_before_fork`
void refuse_pictures_in_fork();

}  // namespace walker::mujoco
