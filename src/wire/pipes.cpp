#include "wire/pipes.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <string>

#include "base/posix.h"

namespace walker {
namespace {

using Ends = std::array<int, 2>;  // of a pipe: for reading, for writing

void close_if_open(int descriptor) {
  if (descriptor >= 0) close(descriptor);
}

/// A message of one byte with two file descriptors.
class Handover {
 public:
  Handover() {
    message_.msg_iov = &bytes_;
    message_.msg_iovlen = 1;
    message_.msg_control = control_;
    message_.msg_controllen = sizeof(control_);
  }

  bool send(int socket, const Ends& ends) {
    cmsghdr* const header = CMSG_FIRSTHDR(&message_);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(Ends));
    std::memcpy(CMSG_DATA(header), ends.data(), sizeof(Ends));
    return sendmsg(socket, &message_, MSG_NOSIGNAL | MSG_DONTWAIT) == 1;
  }

  /// @return whether `ends` has been received
  bool receive(int socket, Ends& ends) {
    if (recvmsg(socket, &message_, MSG_CMSG_CLOEXEC | MSG_DONTWAIT) != 1) return false;
    const cmsghdr* const header = CMSG_FIRSTHDR(&message_);
    if (header == nullptr || header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) {
      return false;
    }
    std::memcpy(ends.data(), CMSG_DATA(header), header->cmsg_len - CMSG_LEN(0));
    if (header->cmsg_len == CMSG_LEN(sizeof(Ends))) return true;
    close_if_open(ends[0]);  // this process has no room for the second one
    ends = {-1, -1};
    return false;
  }

 private:
  char byte_ = 0;
  iovec bytes_{&byte_, 1};
  alignas(cmsghdr) char control_[CMSG_SPACE(sizeof(Ends))] = {};
  msghdr message_{};
};

}  // namespace

void Channel::close() const {
  close_if_open(input);
  if (is_pipes()) close_if_open(output);
}

Channel give_pipes(int socket) {
  constexpr int kFlags = O_NONBLOCK | O_CLOEXEC;
  Ends requests{-1, -1};
  Ends answers{-1, -1};
  int both = -1;  // ends of the requests
  bool is_given = false;
  if (pipe2(requests.data(), kFlags) == 0 && pipe2(answers.data(), kFlags) == 0) {
    const std::string path = "/proc/self/fd/" + std::to_string(requests[1]);
    both = open(path.c_str(), O_RDWR | kFlags);
    is_given = both >= 0 && Handover().send(socket, {answers[0], both});
  }
  close_if_open(both);
  close_if_open(requests[1]);
  close_if_open(answers[0]);
  const Channel own{requests[0], answers[1]};
  if (is_given) return own;
  own.close();
  return {};
}

Channel take_pipes(int socket) {
  Ends ends{-1, -1};
  if (!Handover().receive(socket, ends)) return {};
  const Channel taken{above_standard(ends[0]), above_standard(ends[1])};
  if (taken.input >= 0 && taken.output >= 0) return taken;
  taken.close();
  return {};
}

}  // namespace walker
