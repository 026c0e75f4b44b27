// The local socket that a server offers beside its TCP port, to clients on the same machine.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

namespace walker {

/// Address of the local socket beside a TCP port, which shares memory (wire/channel.h). The name is
/// in Linux's abstract namespace, so that it ends with its socket and needs no file.
class LocalAddress {
 public:
  explicit LocalAddress(std::uint16_t port) {
    const std::string name = "walker_sim/" + std::to_string(port);
    address_.sun_family = AF_UNIX;
    std::copy(name.begin(), name.end(), address_.sun_path + 1);  // after a 0: abstract
    size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  }

  sockaddr* get() { return reinterpret_cast<sockaddr*>(&address_); }
  socklen_t size() const { return size_; }

 private:
  sockaddr_un address_{};
  socklen_t size_;
};

}  // namespace walker
