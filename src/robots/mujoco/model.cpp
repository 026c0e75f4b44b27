#include "robots/mujoco/model.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <locale>
#include <mutex>
#include <new>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "base/posix.h"
#include "base/printable_text.h"
#include "base/state_bytes.h"
#include "robots/mujoco/compile_apart.h"
#include "robots/mujoco/floor.h"

namespace walker::mujoco {
namespace {

/// MuJoCo's default handler ends the process. Exceptions may pass through MuJoCo: its code has
/// unwind tables on all supported platforms, and an mjData is reset before it is used again.
[[noreturn]] void throw_error(const char* message) {
  throw std::runtime_error(std::string("MuJoCo: ") + message);
}

/// MuJoCo's default handler prints, and appends to a file in the working directory. `Physics` reads
/// the warnings that end an episode from its mjData; Gymnasium ignores the others too.
void ignore_warning(const char* /*message*/) {}

void install_handlers() {
  if (mju_user_error == nullptr) mju_user_error = throw_error;
  if (mju_user_warning == nullptr) mju_user_warning = ignore_warning;
}

/// @throws std::runtime_error unless the processor and the operating system support AVX, which
///         MuJoCo's releases for x86-64 require
void check_processor() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx") != 0) return;
  throw std::runtime_error(
      "MuJoCo's library needs a processor with AVX; this one, or its system, does not have it. "
      "BipedalWalker runs without");
#endif
}

/// @throws std::bad_alloc
std::shared_ptr<mjVFS> virtual_file(const std::string& name, const void* bytes, std::size_t size) {
  const std::shared_ptr<mjVFS> files(new mjVFS(), [](mjVFS* made) {
    mj_deleteVFS(made);
    delete made;
  });
  mj_defaultVFS(files.get());
  if (mj_makeEmptyFileVFS(files.get(), name.c_str(), static_cast<int>(size)) != 0) {
    throw std::bad_alloc();
  }
  std::memcpy(files->filedata[0], bytes, size);
  return files;
}

ModelPointer owned(mjModel* model) { return {model, mj_deleteModel}; }

ModelPointer load(const std::vector<std::byte>& bytes) {
  const std::string name = "model.mjb";
  const auto files = virtual_file(name, bytes.data(), bytes.size());
  mjModel* const model = mj_loadModel(name.c_str(), files.get());
  if (model == nullptr) throw std::runtime_error("MuJoCo does not load what it has compiled");
  return owned(model);
}

ModelPointer compile_builtin(const std::string& name) {
  const std::string& text = builtin_models().at(name);
  // The distribution's MuJoCo parses numbers with streams, which use the global locale.
  if (std::locale() != std::locale::classic()) return load(compile_apart(name, {}, &text));
  const auto files = virtual_file(name, text.data(), text.size());
  static std::mutex mutex;  // MuJoCo's compiler has global state
  const std::lock_guard<std::mutex> lock(mutex);
  std::array<char, kMaxErrorBytes> message{};
  mjModel* const model = mj_loadXML(name.c_str(), files.get(), message.data(), kMaxErrorBytes);
  if (model == nullptr) throw std::runtime_error(message.data());
  return owned(model);
}

/// Checks settings of the solver's and renderer's work, which MuJoCo does not limit.
/// @throws std::runtime_error naming the setting, its value and its range
void check_settings(const mjModel& model) {
  struct Setting {
    const char* name;
    int value;
    int least;
    int most;
  };
  constexpr int kMaxIterations = 10000;
  constexpr int kMaxBufferPixels = 16384;
  constexpr int kMaxFacets = 1000;
  const auto& quality = model.vis.quality;
  for (const Setting& setting : {
           Setting{"option iterations", model.opt.iterations, 0, kMaxIterations},
           Setting{"option noslip_iterations", model.opt.noslip_iterations, 0, kMaxIterations},
           Setting{"option mpr_iterations", model.opt.mpr_iterations, 0, kMaxIterations},
           Setting{"global offwidth", model.vis.global.offwidth, 1, kMaxBufferPixels},
           Setting{"global offheight", model.vis.global.offheight, 1, kMaxBufferPixels},
           Setting{"quality shadowsize", quality.shadowsize, 0, kMaxBufferPixels},
           Setting{"quality offsamples", quality.offsamples, 0, 64},
           Setting{"quality numslices", quality.numslices, 1, kMaxFacets},
           Setting{"quality numstacks", quality.numstacks, 1, kMaxFacets},
           Setting{"quality numquads", quality.numquads, 1, kMaxFacets},
       }) {
    if (setting.value >= setting.least && setting.value <= setting.most) continue;
    throw std::runtime_error(std::string(setting.name) + " = " + std::to_string(setting.value) +
                             ": must be in [" + std::to_string(setting.least) + ", " +
                             std::to_string(setting.most) + "]");
  }
}

/// Parses the file in a process of its own. This process loads only what MuJoCo has compiled there.
ModelPointer compile_file(const std::string& xml_file) {
  if (xml_file.find('\0') != std::string::npos) {
    throw std::runtime_error("must not have a zero byte");
  }
  const std::string path = expand_home(xml_file);
  if (is_irregular_file(path)) throw std::runtime_error("must be an XML file, and a regular one");
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  const CompileLimits limits;
  if (!error && size > limits.bytes) {
    throw std::runtime_error("has " + std::to_string(size) + " bytes; must have at most " +
                             std::to_string(limits.bytes));
  }
  ModelPointer result = load(compile_apart(path, limits));
  check_settings(*result);
  return result;
}

/// Key of the cache of models: a built-in model's name, or a file's path, modification time and
/// size. Included files do not count.
std::string identity(const std::string& xml_file) {
  if (builtin_models().count(xml_file) != 0) return xml_file;
  std::error_code error;
  const std::filesystem::path path = std::filesystem::absolute(expand_home(xml_file), error);
  const auto changed = std::filesystem::last_write_time(path, error).time_since_epoch().count();
  const auto size = std::filesystem::file_size(path, error);
  return path.string() + "\n" + std::to_string(changed) + "\n" + std::to_string(size);
}

}  // namespace

void refuse_model(const std::string& xml_file, std::string reason) {
  while (!reason.empty() && reason.back() == '\n') reason.pop_back();
  std::replace(reason.begin(), reason.end(), '\n', ' ');
  throw std::invalid_argument(describe_model(xml_file) + reason);
}

std::string describe_model(const std::string& xml_file) {
  constexpr std::size_t kMaxOfPath = 300;  // a message may repeat the path
  return "parameter xml_file = " + printable(xml_file, kMaxOfPath) + ": ";
}

ModelPointer load_model(const std::string& xml_file) {
  check_processor();
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<const mjModel>> models;
  const std::string key = identity(xml_file);
  std::unique_lock<std::mutex> lock(mutex);
  install_handlers();
  install_ground_contacts();
  if (ModelPointer known = models[key].lock()) return known;
  // Compilation may take long; the host's other threads may load models or fork meanwhile.
  lock.unlock();
  ModelPointer compiled;
  try {
    compiled =
        builtin_models().count(xml_file) != 0 ? compile_builtin(xml_file) : compile_file(xml_file);
  } catch (const std::runtime_error& error) {
    refuse_model(xml_file, error.what());
  }
  lock.lock();
  ModelPointer model = models[key].lock();  // another thread may have compiled it too
  if (!model) models[key] = model = std::move(compiled);
  return model;
}

std::uint64_t fingerprint(const mjModel& model) {
  const int size = mj_sizeModel(&model);
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  mj_saveModel(&model, nullptr, bytes.data(), size);
  return checksum(bytes.data(), bytes.size());
}

}  // namespace walker::mujoco
