#include "mujoco/model.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "core/state_header.h"
#include "core/user_path.h"
#include "mujoco/builtin_models.h"

namespace walker::mujoco {
namespace {

/// MuJoCo would end the process. It may be left by an exception: its code has unwind tables on all
/// platforms of ours, and data in use are reset before they are used again.
[[noreturn]] void throw_error(const char* message) {
  throw std::runtime_error(std::string("MuJoCo: ") + message);
}

/// MuJoCo would print and append to a file in the working directory. `Physics` reads the warnings
/// that end an episode from its data; the others Gymnasium passes over as well.
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

/// A file that MuJoCo finds in memory.
std::unique_ptr<mjVFS, DeleteVirtualFiles> virtual_file(const BuiltinModel& model) {
  std::unique_ptr<mjVFS, DeleteVirtualFiles> files(new mjVFS);
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), model.name.c_str(), static_cast<int>(model.text.size()));
  std::memcpy(files->filedata[0], model.text.data(), model.text.size());
  return files;
}

ModelPointer compile(const std::string& xml_file) {
  constexpr int kMessageSize = 1000;
  std::array<char, kMessageSize> message{};
  mjModel* model = nullptr;
  try {
    if (const BuiltinModel* builtin = find_builtin(xml_file)) {
      const auto files = virtual_file(*builtin);
      model = mj_loadXML(builtin->name.c_str(), files.get(), message.data(), kMessageSize);
    } else {
      model = mj_loadXML(expand_home(xml_file).c_str(), nullptr, message.data(), kMessageSize);
    }
  } catch (const std::runtime_error& error) {
    refuse_model(xml_file, error.what());
  }
  if (model == nullptr) refuse_model(xml_file, message.data());
  return {model, mj_deleteModel};
}

/// What distinguishes one model from another: the name, and for a file its size and time of change.
/// Files that it includes do not count.
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
  throw std::invalid_argument("parameter xml_file = " + xml_file + ": " + reason);
}

ModelPointer load_model(const std::string& xml_file) {
  static std::mutex mutex;  // MuJoCo's compiler has global state
  static std::map<std::string, std::weak_ptr<const mjModel>> models;
  const std::lock_guard<std::mutex> lock(mutex);
  install_handlers();
  std::weak_ptr<const mjModel>& known = models[identity(xml_file)];
  ModelPointer model = known.lock();
  if (!model) {
    model = compile(xml_file);
    known = model;
  }
  return model;
}

std::uint64_t fingerprint(const mjModel& model) {
  const int size = mj_sizeModel(&model);
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  mj_saveModel(&model, nullptr, bytes.data(), size);
  return checksum(bytes.data(), bytes.size());
}

}  // namespace walker::mujoco
