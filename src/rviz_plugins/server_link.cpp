#include "rviz_plugins/server_link.h"

#include <utility>
#include <vector>

#include <ros/names.h>
#include <std_srvs/Trigger.h>
#include <boost/make_shared.hpp>

#include "base/parameter_text.h"
#include "walker_sim/GetSpec.h"
#include "walker_sim/Reset.h"
#include "walker_sim/SetRealTimeFactor.h"
#include "walker_sim/Step.h"

namespace walker {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kBetweenLooks{1};
constexpr std::chrono::seconds kPatience{5};  // with one call

class Task : public ros::CallbackInterface {
 public:
  explicit Task(std::function<void()> task) : task_(std::move(task)) {}
  CallResult call() override {
    task_();
    return Success;
  }

 private:
  std::function<void()> task_;
};

/// Returns the value of the key, or an empty string.
std::string value_of(const diagnostic_msgs::DiagnosticStatus& status, const char* key) {
  for (const diagnostic_msgs::KeyValue& pair : status.values) {
    if (pair.key == key) return pair.value;
  }
  return "";
}

bool is_status(const diagnostic_msgs::DiagnosticStatus& status, const std::string& task) {
  const std::string ending = ": " + task;
  return status.name.size() > ending.size() &&
         status.name.compare(status.name.size() - ending.size(), ending.size(), ending) == 0;
}

template <typename Response>
auto text_of(const Response& response) -> decltype(response.status_message) {
  return response.status_message;
}
std::string text_of(const std_srvs::TriggerResponse& response) { return response.message; }

}  // namespace

ServerLink::ServerLink() {
  node_.setCallbackQueue(&queue_);
  thread_ = std::thread([this] { run(); });
}

ServerLink::~ServerLink() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    client_.shutdown();
  }
  queue_.disable();
  thread_.join();
}

void ServerLink::run() {
  Clock::time_point next_look = Clock::now();
  while (true) {
    {
      const std::lock_guard lock(mutex_);
      if (is_ending_) return;
    }
    queue_.callAvailable(ros::WallDuration(0.1));
    if (Clock::now() < next_look) continue;
    if (!server_.empty()) look_for_server();
    next_look = Clock::now() + kBetweenLooks;
  }
}

void ServerLink::post(std::function<void()> task) {
  queue_.addCallback(boost::make_shared<Task>(std::move(task)));
}

void ServerLink::connect(const std::string& name) {
  post([this, name] {
    std::string why;
    const bool is_valid = ros::names::validate(name, why) && !name.empty();
    server_ = is_valid ? ros::names::resolve(name) : "";
    {
      const std::lock_guard lock(mutex_);
      view_ = {};
      if (!is_valid) view_.trouble = "invalid node name: " + (name.empty() ? "it is empty" : why);
    }
    progress_.shutdown();
    diagnostics_.shutdown();
    if (!is_valid) return;
    subscribe();
    look_for_server();
  });
}

void ServerLink::subscribe() {
  const std::string space = ros::names::parentNamespace(server_);
  const auto hints = ros::TransportHints().tcpNoDelay();
  progress_ = node_.subscribe<walker_sim::Episode>(
      ros::names::append(space, "progress"), 1000,
      [this](const walker_sim::Episode::ConstPtr& message) { take(*message); }, ros::VoidConstPtr(),
      hints);
  using Event = ros::MessageEvent<const diagnostic_msgs::DiagnosticArray>;
  const boost::function<void(const Event&)> callback = [this](const Event& event) { take(event); };
  diagnostics_ =
      node_.subscribe<diagnostic_msgs::DiagnosticArray, const Event&>("/diagnostics", 10, callback);
}

void ServerLink::take(const walker_sim::Episode& progress) {
  const std::lock_guard lock(mutex_);
  // Without its beginning if the topics have not shown that.
  if (progress.episode != episode_ || progress.length <= length_) {
    view_.previous = std::exchange(view_.present, {});
    episode_ = progress.episode;
  }
  length_ = progress.length;
  view_.present.add(progress.length, progress.episode_return);
}

void ServerLink::take(const ros::MessageEvent<const diagnostic_msgs::DiagnosticArray>& event) {
  if (event.getPublisherName() != server_) return;
  const std::lock_guard lock(mutex_);
  for (const diagnostic_msgs::DiagnosticStatus& status : event.getMessage()->status) {
    if (is_status(status, "simulation")) view_.is_paused = value_of(status, "paused") == "True";
    if (!is_status(status, "pace")) continue;
    const std::string wanted = value_of(status, "real_time_factor_wanted");
    view_.wanted_factor = parse_number(wanted);  // "-" is none
    view_.factor = parse_number(value_of(status, "real_time_factor")).value_or(0);
  }
}

/// @return whether there was an answer
template <typename Service>
bool ServerLink::call(const std::string& service, Service& message) {
  // A persistent client can be shut down by another thread, which ends the call.
  auto client = node_.serviceClient<Service>(server_ + "/" + service, true);
  {
    const std::lock_guard lock(mutex_);
    if (is_ending_) return false;
    client_ = client;
    called_at_ = Clock::now();
  }
  const bool is_answered = client.isValid() && client.call(message);
  const std::lock_guard lock(mutex_);
  const bool is_late = !called_at_;
  called_at_.reset();
  client_ = {};
  if (is_answered) {
    view_.trouble.clear();
  } else if (!is_late) {
    view_.trouble = "no server " + server_;
  }
  return is_answered;
}

template <typename Service>
void ServerLink::call_and_report(const std::string& service, Service& message,
                                 const std::string& done) {
  if (server_.empty() || !call(service, message)) {
    report(service + ": no answer", true);
  } else if (message.response.success == 0) {
    report(text_of(message.response), true);
  } else {
    const std::string text = text_of(message.response);
    report(done + (text.empty() ? "" : ": " + text), false);
  }
}

void ServerLink::report(const std::string& answer, bool is_refused) {
  const std::lock_guard lock(mutex_);
  view_.answer = answer;
  view_.is_refused = is_refused;
  ++view_.num_answers;
}

void ServerLink::look_for_server() {
  walker_sim::GetSpec spec;
  walker_sim::GetWorlds worlds;
  if (!call("get_spec", spec) || !call("get_worlds", worlds)) return;
  const std::lock_guard lock(mutex_);
  view_.spec = spec.response.spec;
  view_.worlds = worlds.response;
}

void ServerLink::reset(std::optional<std::uint64_t> seed, const walker_sim::World& world) {
  post([this, seed, world] {
    walker_sim::Reset service;
    service.request.has_seed = seed ? 1 : 0;
    service.request.seed = seed.value_or(0);
    service.request.world = world;
    call_and_report("reset", service, seed ? "reset with seed " + std::to_string(*seed) : "reset");
    look_for_server();  // which has this world now
  });
}

void ServerLink::step() {
  post([this] {
    walker_sim::Step service;
    {
      const std::lock_guard lock(mutex_);
      service.request.action.resize(view_.spec.action_size);
    }
    call_and_report("step", service, "one step");
  });
}

void ServerLink::set_paused(bool is_paused) {
  post([this, is_paused] {
    std_srvs::Trigger service;
    const std::string name = is_paused ? "pause" : "unpause";
    call_and_report(name, service, name);
    const std::lock_guard lock(mutex_);
    if (service.response.success != 0) view_.is_paused = is_paused && view_.spec.mode == "free";
  });
}

void ServerLink::set_real_time_factor(double factor) {
  post([this, factor] {
    walker_sim::SetRealTimeFactor service;
    service.request.factor = factor;
    call_and_report("set_real_time_factor", service, "real-time factor set");
    const std::lock_guard lock(mutex_);
    if (service.response.success != 0) view_.wanted_factor = factor;
  });
}

ServerView ServerLink::view() {
  const std::lock_guard lock(mutex_);
  if (called_at_ && Clock::now() - *called_at_ > kPatience) {
    called_at_.reset();
    client_.shutdown();
    view_.trouble = "the server does not answer";
  }
  return view_;
}

}  // namespace walker
