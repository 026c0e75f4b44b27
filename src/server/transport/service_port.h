// The services of this node, served by the thread that waits for them.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <poll.h>

#include <ros/serialization.h>
#include <ros/service_traits.h>

#include "ros/checked_stream.h"
#include "server/transport/pending_answer.h"
#include "server/transport/service_session.h"
#include "server/transport/waking.h"

namespace walker {

/// Listens where roscpp would, and registers services at the master. Between the socket and the
/// handler there is no other thread: with roscpp's a round trip makes four hops, and its writes
/// from outside its network thread make that thread spin (docs/transport.md).
///
/// What clients may take of this process has limits: a number of connections, one of bytes for each
/// request, and one for all that is held of unfinished requests and unread answers. Beyond the last
/// the client that has gone longest without a move gives way.
class ServicePort {
 public:
  /// @throws std::system_error when nothing can listen
  ServicePort();
  ServicePort(const ServicePort&) = delete;
  ServicePort& operator=(const ServicePort&) = delete;
  /// Takes the services off the master and closes all connections.
  ~ServicePort();

  /// @tparam Service     generated class
  /// @param  name        resolved
  /// @param  handler     fills the response, or throws a std::exception that says why there is none
  /// @param  array_bytes that the elements of a request's arrays and texts may have; 64 KiB are
  ///                     taken in any case, so that small mistakes are told by their names
  /// @throws std::invalid_argument for a name that is advertised already
  template <typename Service>
  void advertise(
      const std::string& name,
      const std::function<void(typename Service::Request&, typename Service::Response&)>& handler,
      std::size_t array_bytes = 0) {
    offer<Service>(name, array_bytes, [handler](auto& request, tcpros::Bytes& answer) {
      typename Service::Response response;
      handler(request, response);
      append_response(response, answer);
      return nullptr;
    });
  }

  /// The same for what takes its time: everybody else is served until the response comes.
  /// @param handler sees to it that the reply is given, once, in whatever thread
  template <typename Service>
  void advertise_pending(
      const std::string& name,
      const std::function<void(typename Service::Request&,
                               const Reply<typename Service::Response>&)>& handler,
      std::size_t array_bytes = 0) {
    offer<Service>(name, array_bytes,
                   [handler, event = answer_is_given_](auto& request, auto& /*answer*/) {
                     auto pending = std::make_shared<PendingAnswer>(event);
                     handler(request, Reply<typename Service::Response>(pending));
                     return pending;
                   });
  }

  /// Name of the node whose call is being made; for handlers.
  const std::string& caller() const { return *shared_.caller; }

  /// Waits until a client wants something, `other` is readable or the time is over; then gives each
  /// client that wants something one turn.
  /// @param other a descriptor
  /// @return whether it is readable
  bool serve(int other, std::chrono::nanoseconds longest);

 private:
  using Clock = ServiceSession::Clock;

  static constexpr std::size_t kAlwaysTaken = std::size_t{64} << 10U;  // bytes of a request

  /// @param call takes the request, as `OfferedService::call` takes its bytes
  template <typename Service, typename Call>
  void offer(const std::string& name, std::size_t array_bytes, const Call& call) {
    using Request = typename Service::Request;
    namespace service_traits = ros::service_traits;
    namespace message_traits = ros::message_traits;
    const std::size_t most = ros::serialization::serializationLength(Request()) + array_bytes;
    add(name, {service_traits::datatype<Service>(), service_traits::md5sum<Service>(),
               message_traits::datatype<Request>(),
               message_traits::datatype<typename Service::Response>(), std::max(most, kAlwaysTaken),
               [call](const std::uint8_t* bytes, std::size_t size, tcpros::Bytes& answer) {
                 Request request;
                 read_exactly(bytes, size, "the request", request);
                 return call(request, answer);
               }});
  }

  void add(const std::string& name, OfferedService service);
  void wait(int other, std::chrono::nanoseconds longest);
  void serve_sessions();
  void make_room();
  void remove(std::unique_ptr<ServiceSession>& session);
  void accept_clients();
  void turn_away(int descriptor);

  int listener_;
  std::string uri_;
  std::size_t most_sessions_;
  SharedBySessions shared_;
  std::vector<std::unique_ptr<ServiceSession>> sessions_;  // null: over
  std::size_t held_ = 0;                                   // bytes, by all of them
  bool is_any_over_ = false;
  std::shared_ptr<EventDescriptor> answer_is_given_ = std::make_shared<EventDescriptor>();
  std::vector<pollfd> polled_;      // the listener, the other, answers, and the sessions in order
  Clock::time_point now_;           // when they were polled
  Clock::time_point accepts_from_;  // not before: there were no descriptors left
};

}  // namespace walker
