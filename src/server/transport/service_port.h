// The services of this node, served by the thread that polls their sockets.
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

#include "base/spin_wait.h"
#include "ros/checked_message.h"
#include "server/transport/service_session.h"
#include "server/transport/waking.h"

namespace walker {

/// Listens like roscpp and registers services with the master, but runs handlers in the thread that
/// reads the sockets. With roscpp's services a round trip makes four hops between threads, and a
/// write from outside its network thread makes that thread spin.
///
/// Clients' resources are bounded: connections, bytes of a request, bytes of all unfinished
/// requests and unread answers. Beyond the last, the longest idle session with `holds_much` yields.
class ServicePort {
 public:
  /// @param spin longest time to poll for the next request after an answer, before blocking
  /// @throws std::system_error if no socket can listen
  explicit ServicePort(std::chrono::microseconds spin = {});
  ServicePort(const ServicePort&) = delete;
  ServicePort& operator=(const ServicePort&) = delete;
  /// Unregisters the services and closes all connections.
  ~ServicePort();

  /// @param  name        resolved
  /// @param  handler     fills the response, or throws a std::exception with the reason
  /// @param  array_bytes upper bound of the elements of a request's arrays and strings; 64 KiB are
  ///                     always read, so that small mistakes are reported by name
  /// @throws std::invalid_argument if the name is already advertised
  template <typename Service>
  void advertise(
      const std::string& name,
      const std::function<void(typename Service::Request&, typename Service::Response&)>& handler,
      std::size_t array_bytes = 0) {
    advertise_bytes<Service>(name, array_bytes, [handler](auto& request, tcpros::Bytes& answer) {
      typename Service::Response response;
      handler(request, response);
      append_response(response, answer);
      return nullptr;
    });
  }

  /// Advertises a service whose response comes later. Other clients are served meanwhile.
  /// @param handler ensures that the reply is called once, in any thread
  template <typename Service>
  void advertise_pending(
      const std::string& name,
      const std::function<void(typename Service::Request&,
                               const Reply<typename Service::Response>&)>& handler,
      std::size_t array_bytes = 0) {
    advertise_bytes<Service>(name, array_bytes,
                             [handler, event = answer_is_given_](auto& request, auto& /*answer*/) {
                               auto pending = std::make_shared<PendingAnswer>(event);
                               handler(request, Reply<typename Service::Response>(pending));
                               return pending;
                             });
  }

  /// Name of the node whose call is in progress; for handlers.
  const std::string& caller() const { return *shared_.caller; }

  /// Blocks until a session has an event or work, the descriptor `other` is readable or `longest`
  /// has passed; then gives each such session a turn.
  /// @return whether `other` is readable
  bool serve(int other, std::chrono::nanoseconds longest);

 private:
  using Clock = ServiceSession::Clock;

  static constexpr std::size_t kAlwaysAccepted = std::size_t{64} << 10U;  // request bytes
  /// Upper bound of a client's calls in a row without a look at the other clients.
  static constexpr int kMaxCalls = 8;

  /// @param call as `OfferedService::call`, with the deserialised request
  template <typename Service, typename Call>
  void advertise_bytes(const std::string& name, std::size_t array_bytes, const Call& call) {
    using Request = typename Service::Request;
    const std::size_t bound = ros::serialization::serializationLength(Request()) + array_bytes;
    add(name, {ros::service_traits::datatype<Service>(), ros::service_traits::md5sum<Service>(),
               std::max(bound, kAlwaysAccepted),
               [call](const std::uint8_t* bytes, std::size_t size, tcpros::Bytes& answer) {
                 Request request;
                 read_exactly(bytes, size, "the request", request);
                 return call(request, answer);
               }});
  }

  void add(const std::string& name, OfferedService service);
  bool is_full() const { return sessions_.size() >= max_sessions_; }
  void welcome(int descriptor);
  void welcome_locally(int descriptor);
  void add(Channel channel);
  void wait(int other, std::chrono::nanoseconds longest);
  bool has_work() const;
  void serve_sessions();
  ServiceSession::Outcome advance(ServiceSession& session, short happened);
  void make_room();
  void remove(std::unique_ptr<ServiceSession>& session);
  void accept_clients(int listener);

  int listener_;
  int local_listener_;  // of clients that share memory; negative: its name is taken
  std::string uri_;
  std::size_t max_sessions_;
  SharedBySessions shared_;
  std::vector<std::unique_ptr<ServiceSession>> sessions_;  // null: ended
  std::size_t held_ = 0;                                   // bytes of all sessions
  bool is_any_over_ = false;
  ServiceSession* answered_ = nullptr;  // called in the last `serve`; null: none, or it has ended
  SpinWait<> spin_;
  unsigned num_polls_ = 0;  // while spinning
  std::shared_ptr<EventDescriptor> answer_is_given_ = std::make_shared<EventDescriptor>();
  std::vector<pollfd> polled_;      // listeners, `other`, answers, sessions in order
  Clock::time_point now_;           // time of the last poll
  Clock::time_point accepts_from_;  // no accept before: the last one failed
};

}  // namespace walker
