#include "fuzz/scripted_socket.h"

#include <algorithm>

#include "fuzz/target.h"
#include "walker_sim/client.h"
#include "wire/socket.h"

namespace walker {
namespace {

std::vector<std::uint8_t> unread;
int connections = 0;

void take_piece() {
  unread.clear();
  if (fuzz::script().empty()) return;
  unread = std::move(fuzz::script().front());
  fuzz::script().pop_front();
}

}  // namespace

fuzz::Pieces& fuzz::script() {
  static Pieces pieces;
  return pieces;
}

TimePoint::duration Deadline::check() const { return std::chrono::seconds(1); }
void Deadline::take_signal() const {
  if (is_interrupted_ && is_interrupted_()) throw Interrupted();
}

Socket::Socket(const std::string& /*host*/, std::uint16_t /*port*/, const Deadline& /*deadline*/)
    : channel_(-++connections) {}  // no file descriptor
Socket::~Socket() { unread.clear(); }

void Socket::send_all(const void* /*data*/, std::size_t /*size*/, const Deadline& deadline) {
  fuzz::require(channel_.descriptor() == -connections, "the client speaks on its last connection");
  deadline.take_signal();
  take_piece();
}

std::size_t Socket::receive(void* data, std::size_t capacity, const Deadline& /*deadline*/) {
  const std::size_t size = std::min(capacity, unread.size());
  std::copy_n(unread.begin(), size, static_cast<std::uint8_t*>(data));
  unread.erase(unread.begin(), unread.begin() + static_cast<std::ptrdiff_t>(size));
  return size;
}

std::size_t Socket::receive_arrived(void* /*data*/, std::size_t /*capacity*/) { return 0; }

}  // namespace walker
