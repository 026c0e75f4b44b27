#include "robots/mujoco/model.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "base/printable_text.h"
#include "base/state_bytes.h"
#include "base/user_path.h"
#include "robots/mujoco/builtin_models.h"
#include "robots/mujoco/mjcf_limits.h"
#include "robots/mujoco/processor.h"

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

const BuiltinModel* find_builtin(const std::string& name) {
  const std::vector<BuiltinModel>& models = builtin_models();
  const auto found = std::find_if(models.begin(), models.end(), [&name](const BuiltinModel& model) {
    return name == model.name;
  });
  return found == models.end() ? nullptr : &*found;
}

struct DeleteVirtualFiles {
  void operator()(mjVFS* files) const {
    mj_deleteVFS(files);
    delete files;
  }
};

/// @param files null: path is a file on the disk
ModelPointer compile(const std::string& path, const mjVFS* files) {
  std::array<char, 1000> message{};
  mjModel* const model =
      mj_loadXML(path.c_str(), files, message.data(), static_cast<int>(message.size()));
  if (model == nullptr) throw std::runtime_error(message.data());
  return {model, mj_deleteModel};
}

ModelPointer compile(const BuiltinModel& builtin) {
  const std::unique_ptr<mjVFS, DeleteVirtualFiles> files(new mjVFS);
  mj_defaultVFS(files.get());
  const std::string& text = builtin.text;
  if (mj_makeEmptyFileVFS(files.get(), builtin.name.c_str(), static_cast<int>(text.size())) != 0) {
    throw std::bad_alloc();
  }
  std::copy(text.begin(), text.end(), static_cast<char*>(files->filedata[0]));
  return compile(builtin.name, files.get());
}

ModelPointer compile(const std::string& xml_file) {
  try {
    if (const BuiltinModel* builtin = find_builtin(xml_file)) return compile(*builtin);
    if (xml_file.find('\0') != std::string::npos) {
      throw std::runtime_error("must not have a zero byte");
    }
    const std::string path = expand_home(xml_file);
    check_mjcf(path);
    return compile(path, nullptr);
  } catch (const std::runtime_error& error) {
    refuse_model(xml_file, error.what());
  }
}

/// Key of the cache of models: a built-in model's name, or a file's path, modification time and
/// size. Included files do not count.
std::string identity(const std::string& xml_file) {
  if (find_builtin(xml_file) != nullptr) return xml_file;
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
  constexpr std::size_t kMaxOfPath = 300;  // the reason may repeat the path
  throw std::invalid_argument("parameter xml_file = " + printable(xml_file, kMaxOfPath) + ": " +
                              reason);
}

ModelPointer load_model(const std::string& xml_file) {
  check_processor();
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<const mjModel>> models;
  const std::string key = identity(xml_file);
  const std::lock_guard<std::mutex> lock(mutex);  // MuJoCo's compiler has global state, too
  install_handlers();
  ModelPointer model = models[key].lock();
  if (!model) models[key] = model = compile(xml_file);
  return model;
}

std::uint64_t fingerprint(const mjModel& model) {
  const int size = mj_sizeModel(&model);
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  mj_saveModel(&model, nullptr, bytes.data(), size);
  return checksum(bytes.data(), bytes.size());
}

}  // namespace walker::mujoco
