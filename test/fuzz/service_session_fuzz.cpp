// An untrusted client of the services, which sends pieces over a socket.
#include "server/transport/service_session.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include <ros/console.h>

#include "fuzz/input.h"
#include "fuzz/target.h"
#include "ros/checked_message.h"
#include "walker_sim/Step.h"

namespace walker::fuzz {
namespace {

std::shared_ptr<PendingAnswer> step(const std::uint8_t* request, std::size_t size,
                                    tcpros::Bytes& response) {
  walker_sim::StepRequest asked;
  read_exactly(request, size, "the request", asked);
  walker_sim::StepResponse answer;
  answer.transition.action = asked.action;
  append_response(answer, response);
  return nullptr;
}

/// Answers at once, but through a PendingAnswer.
std::shared_ptr<PendingAnswer> render(const std::uint8_t* /*request*/, std::size_t /*size*/,
                                      tcpros::Bytes& /*response*/) {
  static const auto kEvent = std::make_shared<EventDescriptor>();
  auto pending = std::make_shared<PendingAnswer>(kEvent);
  pending->give({1, 0, 0, 0, 0});
  kEvent->clear();
  return pending;
}

SharedBySessions& shared() {
  static SharedBySessions made_once = [] {
    ros::console::set_logger_level(ROSCONSOLE_DEFAULT_NAME, ros::console::levels::Fatal);
    ros::console::notifyLoggerLevelsChanged();
    constexpr std::size_t kMaxRequestBytes = 4096;
    const OfferedService service{"walker_sim/Step", "0123", kMaxRequestBytes, step};
    OfferedService slow = service;
    slow.call = render;
    SharedBySessions made;
    made.services = {{"/walker_sim/step", service}, {"/walker_sim/render", slow}};
    return made;
  }();
  return made_once;
}

void drain(int descriptor) {
  std::array<std::uint8_t, 4096> bytes{};
  while (recv(descriptor, bytes.data(), bytes.size(), MSG_DONTWAIT) > 0) {
  }
}

void run(const std::uint8_t* data, std::size_t size) {
  std::array<int, 2> ends{};
  require(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data()) == 0,
          "there is a pair of sockets");
  {
    ServiceSession session(Channel{ends[0]}, shared());
    Input input(data, size);
    bool is_over = false;
    while (!is_over && input.size() > 0) {
      const std::vector<std::uint8_t> piece = input.piece();
      if (send(ends[1], piece.data(), piece.size(), MSG_NOSIGNAL) < 0) break;
      constexpr int kMaxTurns = 100;
      for (int turn = 0; !is_over && (turn == 0 || session.has_work()) && turn < kMaxTurns;
           ++turn) {
        is_over = session.advance(POLLIN | POLLOUT) == ServiceSession::Outcome::over;
        drain(ends[1]);
      }
    }
  }
  close(ends[1]);
}

const Registered kTarget("service_session", run);

}  // namespace
}  // namespace walker::fuzz
