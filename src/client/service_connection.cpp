#include "client/service_connection.h"

#include <stdexcept>
#include <string>

#include "base/printable_text.h"
#include "client/messages.h"

namespace walker {

ServiceConnection::ServiceConnection(const Endpoint& endpoint, const std::string& name,
                                     const ServiceType& type, const std::string& caller,
                                     std::chrono::microseconds spin, const Deadline& deadline)
    : socket_(endpoint.host, endpoint.port, deadline), spin_(spin) {
  tcpros::Bytes header;
  tcpros::append_header({{"callerid", caller},
                         {"service", name},
                         {"md5sum", type.md5sum},
                         {"type", type.type},
                         {"persistent", "1"}},
                        header);
  socket_.send_all(header.data(), header.size(), deadline);
  const tcpros::Fields answer = receive_header(deadline);
  const auto error = answer.find("error");
  if (error != answer.end()) throw std::runtime_error("its error: " + printable(error->second));
  const auto md5sum = answer.find("md5sum");
  if (md5sum != answer.end() && md5sum->second != type.md5sum) {
    throw std::runtime_error("its " + std::string(type.type) + " has the MD5 " +
                             printable(md5sum->second) + "; here it is " + type.md5sum +
                             ", so it is another version of walker_sim");
  }
}

tcpros::Fields ServiceConnection::receive_header(const Deadline& deadline) {
  receive_at_least(tcpros::kLengthBytes, deadline);
  const std::size_t size = tcpros::load_length(input_.data());
  if (size > tcpros::kMaxHeaderBytes) {
    throw std::runtime_error("it sent a header of " + std::to_string(size) +
                             " bytes; is it a ROS node?");
  }
  receive_at_least(tcpros::kLengthBytes + size, deadline);
  if (received_ != tcpros::kLengthBytes + size)
    throw std::runtime_error("it sent unrequested bytes");
  received_ = 0;
  return tcpros::parse_header(input_.data() + tcpros::kLengthBytes, size);
}

Reader ServiceConnection::call(const tcpros::Bytes& request, std::size_t max_answer_bytes,
                               const Deadline& deadline) {
  constexpr std::size_t kHeadBytes = 1 + tcpros::kLengthBytes;
  socket_.send_all(request.data(), request.size(), deadline);
  received_ = 0;
  const bool has_come = spin_.poll([this] {
    received_ = socket_.receive_arrived(input_.data(), input_.size());
    return received_ > 0;
  });
  receive_at_least(kHeadBytes, deadline);
  if (!has_come) spin_.finish();
  const std::size_t size = tcpros::load_length(&input_[1]);
  if (input_[0] > 1)
    throw std::runtime_error("its answer begins with neither 0 nor 1; is it a ROS node?");
  if (size > max_answer_bytes) {
    throw std::runtime_error("its answer has " + std::to_string(size) +
                             " bytes; must have at most " + std::to_string(max_answer_bytes));
  }
  receive_at_least(kHeadBytes + size, deadline);
  if (received_ != kHeadBytes + size) throw std::runtime_error("it sent unrequested bytes");
  const std::uint8_t* const body = input_.data() + kHeadBytes;
  if (input_[0] == 0) refuse({reinterpret_cast<const char*>(body), size});
  return {body, size};
}

/// The buffer grows with the bytes received, not with the length announced.
void ServiceConnection::receive_at_least(std::size_t size, const Deadline& deadline) {
  while (received_ < size) {
    if (received_ == input_.size()) input_.resize(2 * input_.size());
    const std::size_t count =
        socket_.receive(&input_[received_], input_.size() - received_, deadline);
    if (count == 0) throw SocketError("the server has closed the connection");
    received_ += count;
  }
}

}  // namespace walker
