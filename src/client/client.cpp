#include "walker_sim/client.h"

#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <tuple>
#include <utility>

#include "base/posix.h"
#include "base/shortest_text.h"
#include "base/spin_wait.h"
#include "client/messages.h"
#include "client/service_connection.h"
#include "wire/master.h"

namespace walker {
namespace {

/// Validates the options and fills in defaults. @throws std::invalid_argument
ClientOptions completed(ClientOptions options) {
  const std::string& name = options.server;
  if (name.size() < 2 || name.front() != '/' || name.back() == '/') {
    throw std::invalid_argument("server = \"" + name +
                                "\"; must be a node's full name, e.g. /walker_sim");
  }
  constexpr double kMaxSeconds = 1e6;
  if (std::isnan(options.timeout) || options.timeout <= 0 || options.timeout > kMaxSeconds) {
    throw std::invalid_argument("timeout = " + fixed_text(options.timeout) +
                                " s; must be above 0 and at most 1000000");
  }
  if (options.spin_us < kMeasuredSpin || options.spin_us > kMaxSpinMicroseconds) {
    throw std::invalid_argument("spin_us = " + std::to_string(options.spin_us) +
                                " us; must be an integer in [-1, " +
                                std::to_string(kMaxSpinMicroseconds) + "]");
  }
  const char* const origin = options.master_uri.empty() ? "ROS_MASTER_URI = " : "master_uri = ";
  if (options.master_uri.empty()) {
    const char* const uri = std::getenv("ROS_MASTER_URI");  // NOLINT(concurrency-mt-unsafe)
    options.master_uri = uri != nullptr && *uri != '\0' ? uri : "http://localhost:11311";
  }
  if (options.caller.empty()) options.caller = kCallerId + ("_" + std::to_string(getpid()));
  try {
    parse_uri(options.master_uri, "http");
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(origin + std::string(error.what()));
  }
  return options;
}

}  // namespace

class Client::Implementation {
 public:
  explicit Implementation(const ClientOptions& options) : options_(completed(options)) {}

  /// @param write appends the request's fields to a Writer
  /// @param read  reads the whole response from a Reader
  /// @throws ConnectionError, Interrupted, RequestRefused; std::invalid_argument (request too long)
  template <typename Write, typename Read>
  void call(ServiceIndex index, const Write& write, const Read& read) {
    // A forked child could receive its parent's answers.
    if (num_forks() != num_forks_) throw ConnectionError(kForkedClientError);
    const auto timeout = std::chrono::duration_cast<TimePoint::duration>(
        std::chrono::duration<double>(options_.timeout));
    const Deadline until(std::chrono::steady_clock::now() + timeout, options_.is_interrupted);
    request_.assign(tcpros::kLengthBytes, 0);
    Writer writer(request_);
    write(writer);
    if (request_.size() - tcpros::kLengthBytes > tcpros::kMaxMessageBytes) {
      throw std::invalid_argument("a request of " + std::to_string(request_.size()) +
                                  " bytes; at most " + std::to_string(tcpros::kMaxMessageBytes) +
                                  " can be sent");
    }
    tcpros::store_length(request_.size() - tcpros::kLengthBytes, request_.data());
    ServiceConnection& connection = connected(index, until);
    try {
      Reader answer = connection.call(request_, max_answer_bytes(index, server), until);
      read(answer);
    } catch (const RequestRefused&) {
      throw;
    } catch (const std::runtime_error& error) {
      const std::string whom = describe(index);
      disconnect();
      throw ConnectionError(whom + ": " + error.what() +
                            "; the server may or may not have executed the call, and a restarted "
                            "server has lost its episode: reset before the next step");
    } catch (...) {
      disconnect();  // Interrupted, or std::bad_alloc, within an answer
      throw;
    }
  }

  /// Returns a `read` for `call` that leaves `result` unchanged if the answer is malformed: it
  /// reads into `results_` and swaps.
  /// @param by further arguments of the overload in messages.h
  template <typename Result, typename... By>
  auto into(Result& result, const By&... by) {
    return [&](Reader& reader) {
      auto& own = std::get<Result>(results_);
      read(reader, server, by..., own);
      std::swap(own, result);
    };
  }

  ServerSpecification server;  ///< as last received
  Reset reset;                 ///< keeps its memory between resets and restores

 private:
  std::string name(ServiceIndex index) const {
    return options_.server + "/" + kServiceTypes[index].name;
  }

  std::string describe(ServiceIndex index) const {
    return "service " + name(index) + " at " + endpoints_[index].text();
  }

  /// Returns the connection to a service, opened on first use.
  ServiceConnection& connected(ServiceIndex index, const Deadline& until) {
    std::optional<ServiceConnection>& connection = connections_[index];
    if (connection) return *connection;
    endpoints_[index] = look_up_service(options_.master_uri, name(index), until);
    try {
      return connection.emplace(endpoints_[index], name(index), kServiceTypes[index],
                                options_.caller, spin_limit(options_.spin_us), until);
    } catch (const SocketError& error) {
      throw ConnectionError(describe(index) + ", its address in the ROS master: " + error.what() +
                            "; has the server died, or can its host not be reached under this "
                            "name (the server's ROS_HOSTNAME or ROS_IP)?");
    } catch (const std::runtime_error& error) {
      throw ConnectionError(describe(index) + ": " + error.what());
    }
  }

  /// Closes all connections: if one failed, the server itself has probably failed.
  void disconnect() {
    for (std::optional<ServiceConnection>& connection : connections_) connection.reset();
  }

  ClientOptions options_;
  unsigned num_forks_ = num_forks();
  std::array<Endpoint, kServiceTypes.size()> endpoints_;
  std::array<std::optional<ServiceConnection>, kServiceTypes.size()> connections_;
  tcpros::Bytes request_;  // these two keep their memory between calls
  std::tuple<Transition, Reset, RepeatedStep, BatchTransition, BatchReset,
             std::vector<std::uint8_t>>
      results_;
};

Client::Client(const ClientOptions& options)
    : implementation_(std::make_unique<Implementation>(options)) {
  specification();
}

Client::~Client() = default;

ServerSpecification Client::specification() {
  ServerSpecification received;
  implementation_->call(
      kGetSpec, [](Writer&) {}, [&](Reader& reader) { read(reader, received); });
  return implementation_->server = std::move(received);
}

void Client::reset(std::optional<std::uint64_t> seed, Transition& transition) {
  Reset& reset = implementation_->reset;
  this->reset(seed, std::nullopt, reset);
  std::swap(reset.transition, transition);
}

void Client::reset(std::optional<std::uint64_t> seed, const std::optional<World>& world,
                   Reset& reset) {
  implementation_->call(
      kReset,
      [&](Writer& writer) {
        writer.number(std::uint8_t{seed.has_value()});
        writer.number(seed.value_or(0));
        write(writer, world);
      },
      implementation_->into(reset));
}

void Client::set_world(const std::vector<std::uint32_t>& environments,
                       const std::vector<World>& worlds) {
  implementation_->call(
      kSetWorld,
      [&](Writer& writer) {
        writer.array(environments.data(), environments.size());
        write(writer, worlds);
      },
      [](Reader& reader) { read(reader); });
}

void Client::step(const double* action, std::size_t size, Transition& transition) {
  implementation_->call(
      kStep, [&](Writer& writer) { writer.array(action, size); },
      implementation_->into(transition));
}

void Client::step_many(const double* action, std::size_t size, std::uint32_t steps,
                       RepeatedStep& repeated) {
  implementation_->call(
      kStepMany,
      [&](Writer& writer) {
        writer.array(action, size);
        writer.number(steps);
      },
      implementation_->into(repeated, steps));
}

void Client::snapshot(std::vector<std::uint8_t>& record) {
  implementation_->call(
      kSnapshot, [](Writer&) {}, implementation_->into(record));
}

void Client::restore(const std::vector<std::uint8_t>& record, Transition& transition) {
  Reset& reset = implementation_->reset;
  restore(record, reset);
  std::swap(reset.transition, transition);
}

void Client::restore(const std::vector<std::uint8_t>& record, Reset& reset) {
  implementation_->call(
      kRestore, [&](Writer& writer) { writer.message(record); }, implementation_->into(reset));
}

void Client::set_state(std::uint32_t environment, const std::vector<double>& position,
                       const std::vector<double>& velocity, Transition& transition) {
  implementation_->call(
      kSetState,
      [&](Writer& writer) {
        writer.number(environment);
        writer.array(position.data(), position.size());
        writer.array(velocity.data(), velocity.size());
      },
      implementation_->into(transition));
}

void Client::reset_batch(const std::vector<std::uint32_t>& environments,
                         const std::vector<std::optional<std::uint64_t>>& seeds,
                         BatchReset& reset) {
  reset_batch(environments, seeds, {}, reset);
}

void Client::reset_batch(const std::vector<std::uint32_t>& environments,
                         const std::vector<std::optional<std::uint64_t>>& seeds,
                         const std::vector<World>& worlds, BatchReset& reset) {
  const std::size_t rows =
      environments.empty() ? implementation_->server.num_envs : environments.size();
  implementation_->call(
      kResetBatch,
      [&](Writer& writer) {
        writer.array(environments.data(), environments.size());
        writer.number(static_cast<std::uint32_t>(seeds.size()));
        for (const auto& seed : seeds) writer.number(std::uint8_t{seed.has_value()});
        writer.number(static_cast<std::uint32_t>(seeds.size()));
        for (const auto& seed : seeds) writer.number(seed.value_or(0));
        write(writer, worlds);
      },
      implementation_->into(reset, rows));
}

void Client::step_batch(const double* actions, std::size_t size, BatchTransition& transition) {
  implementation_->call(
      kStepBatch, [&](Writer& writer) { writer.array(actions, size); },
      implementation_->into(transition));
}

void Client::render(std::uint32_t environment, const std::string& encoding,
                    const Parameters& camera, Image& image) {
  implementation_->call(
      kRender,
      [&](Writer& writer) {
        writer.number(environment);
        writer.text(encoding);
        writer.number(static_cast<std::uint32_t>(camera.size()));
        for (const auto& parameter : camera) writer.text(parameter.first);
        writer.number(static_cast<std::uint32_t>(camera.size()));
        for (const auto& parameter : camera) writer.text(to_string(parameter.second));
      },
      [&](Reader& reader) { read(reader, encoding, camera, image); });
}

}  // namespace walker
