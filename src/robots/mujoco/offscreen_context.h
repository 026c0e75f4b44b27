// Where MuJoCo draws without a window.
#pragma once

#include <memory>

namespace walker::mujoco {

/// An OpenGL context with no surface of its own: MuJoCo brings its off-screen buffer.
///
/// A thread draws with one context at a time, and others in this process (a window's, another
/// renderer's) may hold this one. So each use is a thread of its own, which nothing else draws in.
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

/// A context of EGL (hardware or software), or of OSMesa (software) where there is no EGL. The
/// environment variable MUJOCO_GL, which MuJoCo's and Gymnasium's renderers read too, asks for
/// `egl` or `osmesa` alone; any other value leaves the choice here. The first picture's choice
/// stays the process's.
/// @throws std::runtime_error saying what was tried and what to install; as
/// `refuse_pictures_in_fork`
std::unique_ptr<OffscreenContext> make_offscreen_context();

/// Whether this is the child of a fork whose parent had made a context: OpenGL's threads and locks
/// are the parent's, and a call would block for ever.
bool has_drawn_before_fork();

/// @throws std::runtime_error if `has_drawn_before_fork`
void refuse_pictures_in_fork();

}  // namespace walker::mujoco
