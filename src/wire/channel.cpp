#include "wire/channel.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/posix.h"

namespace walker {

/// Bytes in one direction. All numbers are the peer's or this process's last word, hence unchecked.
struct SharedRing {
  static constexpr std::uint32_t kCapacity = 1U << 16U;  // as a pipe's

  alignas(64) std::atomic<std::uint32_t> written;  // bytes so far, modulo 2^32
  std::atomic<std::uint32_t> reader_waits;         // 1: the writer shall wake the reader
  alignas(64) std::atomic<std::uint32_t> read;     // bytes so far, modulo 2^32
  std::atomic<std::uint32_t> writer_waits;         // 1: the reader shall wake the writer
  alignas(64) std::array<std::uint8_t, kCapacity> bytes;
};

namespace {

struct SharedMemory {
  SharedRing requests;
  SharedRing answers;
};

static_assert(std::atomic<std::uint32_t>::is_always_lock_free, "processes share no locks");

/// Takes a request to wake the peer, which it makes before it looks at the ring once more. One of
/// the two therefore sees the other's store.
bool takes(std::atomic<std::uint32_t>& request) { return request != 0 && request.exchange(0) != 0; }

/// @return the mapping; null if it fails
SharedMemory* map(int descriptor) {
  void* const mapped =
      mmap(nullptr, sizeof(SharedMemory), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  return mapped == MAP_FAILED ? nullptr : static_cast<SharedMemory*>(mapped);
}

/// Makes memory of zeros whose size the client cannot change: access beyond it would be fatal.
/// @return its file descriptor; negative if that fails, e.g. by a limit of the size of files
int make_memory() {
  const int descriptor = memfd_create("walker_sim", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (descriptor < 0) return descriptor;
  if (ftruncate(descriptor, sizeof(SharedMemory)) == 0 &&
      fcntl(descriptor, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) == 0) {
    return descriptor;
  }
  close(descriptor);
  return -1;
}

/// Whether the file is memory as `make_memory` makes it, which the server cannot shrink either.
bool is_memory(int descriptor) {
  struct stat status {};
  const int seals = fcntl(descriptor, F_GET_SEALS);
  return seals >= 0 && (seals & F_SEAL_SHRINK) != 0 && fstat(descriptor, &status) == 0 &&
         status.st_size == off_t{sizeof(SharedMemory)};
}

/// A message of one byte with a file descriptor.
class Handover {
 public:
  Handover() {
    message_.msg_iov = &bytes_;
    message_.msg_iovlen = 1;
    message_.msg_control = control_;
    // Without the padding, in which the kernel would deliver a second descriptor.
    message_.msg_controllen = CMSG_LEN(sizeof(int));
  }

  bool send(int socket, int descriptor) {
    cmsghdr* const header = CMSG_FIRSTHDR(&message_);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(descriptor));
    std::memcpy(CMSG_DATA(header), &descriptor, sizeof(descriptor));
    return sendmsg(socket, &message_, MSG_NOSIGNAL | MSG_DONTWAIT) == 1;
  }

  /// @return negative if there is none
  int receive(int socket) {
    if (recvmsg(socket, &message_, MSG_CMSG_CLOEXEC | MSG_DONTWAIT) != 1) return -1;
    const cmsghdr* const header = CMSG_FIRSTHDR(&message_);
    if (header == nullptr || header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) {
      return -1;
    }
    int descriptor = -1;
    std::memcpy(&descriptor, CMSG_DATA(header), sizeof(descriptor));
    return descriptor;
  }

 private:
  char byte_ = 0;
  iovec bytes_{&byte_, 1};
  alignas(cmsghdr) char control_[CMSG_SPACE(sizeof(int))] = {};
  msghdr message_{};
};

}  // namespace

Channel::Channel(Channel&& other) noexcept { *this = std::move(other); }

Channel& Channel::operator=(Channel&& other) noexcept {
  if (this == &other) return *this;
  close();
  socket_ = std::exchange(other.socket_, -1);
  memory_ = std::exchange(other.memory_, nullptr);
  input_ = std::exchange(other.input_, nullptr);
  output_ = std::exchange(other.output_, nullptr);
  read_ = other.read_;
  written_ = other.written_;
  is_at_end_ = other.is_at_end_;
  return *this;
}

Channel::~Channel() { close(); }

void Channel::close() {
  if (memory_ != nullptr) munmap(memory_, sizeof(SharedMemory));
  if (socket_ >= 0) ::close(socket_);
}

Channel Channel::share(Channel local) {
  const int descriptor = make_memory();
  if (descriptor < 0) return {};
  SharedMemory* const memory = map(descriptor);
  const bool is_sent = memory != nullptr && Handover().send(local.socket_, descriptor);
  ::close(descriptor);
  if (memory == nullptr) return {};
  local.add_memory(memory, memory->requests, memory->answers);
  return is_sent ? std::move(local) : Channel();
}

Channel Channel::join(Channel local) {
  const int descriptor = Handover().receive(local.socket_);
  if (descriptor < 0) return {};
  SharedMemory* const memory = is_memory(descriptor) ? map(descriptor) : nullptr;
  ::close(descriptor);
  if (memory == nullptr) return {};
  local.add_memory(memory, memory->answers, memory->requests);
  return local;
}

void Channel::add_memory(void* memory, SharedRing& input, SharedRing& output) {
  memory_ = memory;
  input_ = &input;
  output_ = &output;
}

ssize_t Channel::read(void* data, std::size_t size) {
  if (!is_shared()) return ::read(socket_, data, size);
  const std::uint32_t available = input_->written - read_;
  if (available == 0 || available > SharedRing::kCapacity) {
    if (is_at_end_ || available != 0) return 0;  // more than the ring holds: not from our client
    errno = EAGAIN;
    return -1;
  }
  const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(size, available));
  const std::uint32_t begin = read_ % SharedRing::kCapacity;
  const std::uint32_t first = std::min(count, SharedRing::kCapacity - begin);
  std::memcpy(data, &input_->bytes[begin], first);
  std::memcpy(static_cast<std::uint8_t*>(data) + first, input_->bytes.data(), count - first);
  read_ += count;
  input_->read = read_;
  if (takes(input_->writer_waits)) wake_peer();
  return count;
}

ssize_t Channel::write(const void* data, std::size_t size) {
  if (!is_shared()) return send(socket_, data, size, MSG_NOSIGNAL);
  const std::uint32_t unread = written_ - output_->read;
  if (is_at_end_ || unread >= SharedRing::kCapacity) {
    errno = is_at_end_ || unread > SharedRing::kCapacity ? EPIPE : EAGAIN;
    return -1;
  }
  const auto count =
      static_cast<std::uint32_t>(std::min<std::size_t>(size, SharedRing::kCapacity - unread));
  const std::uint32_t begin = written_ % SharedRing::kCapacity;
  const std::uint32_t first = std::min(count, SharedRing::kCapacity - begin);
  std::memcpy(&output_->bytes[begin], data, first);
  std::memcpy(output_->bytes.data(), static_cast<const std::uint8_t*>(data) + first, count - first);
  written_ += count;
  output_->written = written_;
  if (takes(output_->reader_waits)) wake_peer();
  return count;
}

bool Channel::has_input() const { return is_shared() && (is_at_end_ || input_->written != read_); }

bool Channel::has_room() const {
  return is_shared() && (is_at_end_ || written_ - output_->read != SharedRing::kCapacity);
}

bool Channel::await_input() {
  if (!is_shared()) return true;
  input_->reader_waits = 1;
  if (!has_input()) return true;
  input_->reader_waits = 0;
  return false;
}

bool Channel::await_room() {
  if (!is_shared()) return true;
  output_->writer_waits = 1;
  if (!has_room()) return true;
  output_->writer_waits = 0;
  return false;
}

void Channel::take_wakeup() {
  if (!is_shared()) return;
  std::array<char, 64> bytes{};
  const ssize_t size = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) is_at_end_ = true;
}

/// If the socket takes no more bytes, the peer has enough to be woken by.
void Channel::wake_peer() const { send(socket_, "", 1, MSG_NOSIGNAL | MSG_DONTWAIT); }

}  // namespace walker
