#include "server/transport/service_port.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <ros/console.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <ros/transport/transport_tcp.h>
#include <ros/xmlrpc_manager.h>

#include "base/posix.h"

namespace walker {
namespace {

// roscpp's keepalive values: the loss of a client's machine is detected within minutes.
constexpr int kIdleSeconds = 60;
constexpr int kProbeSeconds = 10;
constexpr int kProbes = 9;

/// Makes a socket listen on every address, or on loopback alone (`bind` in ros/interposed.cpp).
/// @return the port that the system has chosen
std::uint16_t listen_anywhere(int descriptor) {
  const bool is_ipv6 = ros::TransportTCP::s_use_ipv6_;
  sockaddr_in6 any{};  // a sockaddr_in has its port in the same place
  any.sin6_family = is_ipv6 ? AF_INET6 : AF_INET;
  auto* const address = reinterpret_cast<sockaddr*>(&any);
  socklen_t size = is_ipv6 ? sizeof(sockaddr_in6) : sizeof(sockaddr_in);
  checked(bind(descriptor, address, size), "service port: bind");
  checked(listen(descriptor, SOMAXCONN), "service port: listen");
  checked(getsockname(descriptor, address, &size), "service port: getsockname");
  return ntohs(any.sin6_port);
}

int make_socket(int family) {
  return checked(socket(family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0),
                 "service port: socket");
}

/// @return a socket that listens beside the port; negative if another process has its name
int listen_locally(std::uint16_t port) {
  LocalAddress address(port);
  const int descriptor = make_socket(AF_UNIX);
  if (bind(descriptor, address.get(), address.size()) == 0 && listen(descriptor, SOMAXCONN) == 0) {
    return descriptor;
  }
  close(descriptor);
  return -1;
}

/// Upper bound of the sessions: half of the file descriptors is left for topics and the rest.
std::size_t max_sessions() {
  constexpr std::size_t kMaxConnections = 1000;
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return kMaxConnections;
  return std::min<std::size_t>(kMaxConnections, limit.rlim_cur / 2);
}

void set(int descriptor, int level, int option, int value) {
  // An error is ignored: the connection works without the option.
  setsockopt(descriptor, level, option, &value, sizeof(value));
}

/// @return whether the master accepted it
bool call_master_api(const std::string& method, const std::string& service,
                     const std::string& uri) {
  const bool is_registration = method == "registerService";
  XmlRpc::XmlRpcValue request;
  request[0] = ros::this_node::getName();
  request[1] = service;
  request[2] = uri;
  if (is_registration) request[3] = ros::XMLRPCManager::instance()->getServerURI();
  XmlRpc::XmlRpcValue response;
  XmlRpc::XmlRpcValue payload;
  return ros::master::execute(method, request, response, payload, is_registration);
}

}  // namespace

ServicePort::ServicePort(std::chrono::microseconds spin)
    : max_sessions_(max_sessions()), spin_(spin) {
  listener_ = make_socket(ros::TransportTCP::s_use_ipv6_ ? AF_INET6 : AF_INET);
  try {
    const std::uint16_t port = listen_anywhere(listener_);
    uri_ = "rosrpc://" + ros::network::getHost() + ":" + std::to_string(port);
    local_listener_ = listen_locally(port);
  } catch (...) {
    close(listener_);
    throw;
  }
}

ServicePort::~ServicePort() {
  for (const auto& [name, service] : shared_.services) {
    if (!call_master_api("unregisterService", name, uri_)) break;  // the master is gone
  }
  close(listener_);
  if (local_listener_ >= 0) close(local_listener_);
}

void ServicePort::add(const std::string& name, OfferedService service) {
  if (!shared_.services.emplace(name, std::move(service)).second) {
    throw std::invalid_argument("service " + name +
                                ": is advertised already; two names are "
                                "remapped to one");
  }
  call_master_api("registerService", name, uri_);
}

bool ServicePort::serve(int other, std::chrono::nanoseconds longest) {
  wait(other, longest);
  if (polled_[3].revents != 0) answer_is_given_->clear();  // before the sessions check them
  serve_sessions();
  if (std::exchange(is_any_over_, false)) {
    sessions_.erase(std::remove(sessions_.begin(), sessions_.end(), nullptr), sessions_.end());
  }
  if (polled_[0].revents != 0) accept_clients(listener_);
  if (polled_[1].revents != 0) accept_clients(local_listener_);
  return polled_[2].revents != 0;
}

/// Whether a session has work that ppoll() does not report.
bool ServicePort::has_work() const {
  return std::any_of(sessions_.begin(), sessions_.end(),
                     [](const auto& session) { return session->has_work(); });
}

void ServicePort::serve_sessions() {
  constexpr std::size_t kFirstSession = 4;
  for (std::size_t i = 0; i < sessions_.size(); ++i) {
    if (!sessions_[i]) continue;  // make_room has removed it
    const short happened = polled_[kFirstSession + i].revents;
    if (happened == 0 && !sessions_[i]->has_work()) {
      if (sessions_[i]->is_overdue(now_)) {
        log_client(shared_, "is cut off", "it has sent no header");
        remove(sessions_[i]);
      }
      continue;
    }
    const std::size_t before = sessions_[i]->held();
    const bool is_over = advance(*sessions_[i], happened) == ServiceSession::Outcome::over;
    held_ += sessions_[i]->held() - before;  // may be negative, modulo 2^64
    if (is_over) remove(sessions_[i]);
    if (held_ > kMaxHeldBytes) make_room();
  }
}

ServiceSession::Outcome ServicePort::advance(ServiceSession& session, short happened) {
  // If the client blocks on this core, it runs as soon as it has its answer, so its next request
  // has often arrived already and needs no poll. Other clients wait, so the calls are limited.
  const int max_calls = spin_.pays() ? 1 : kMaxCalls;
  ServiceSession::Outcome outcome = session.advance(happened);
  if (outcome == ServiceSession::Outcome::called) answered_ = &session;
  for (int calls = 1; outcome == ServiceSession::Outcome::called && calls < max_calls; ++calls) {
    outcome = session.advance(session.is_shared() ? short{0} : short{POLLIN});
  }
  return outcome;
}

void ServicePort::remove(std::unique_ptr<ServiceSession>& session) {
  if (answered_ == session.get()) answered_ = nullptr;
  held_ -= session->held();
  session.reset();
  is_any_over_ = true;
}

/// Sessions without `holds_much` never exceed the bound together.
void ServicePort::make_room() {
  while (held_ > kMaxHeldBytes) {
    std::unique_ptr<ServiceSession>* last = nullptr;
    for (std::unique_ptr<ServiceSession>& session : sessions_) {
      if (!session || !session->holds_much()) continue;
      if (last == nullptr || session->moved_at() < (*last)->moved_at()) last = &session;
    }
    if (last == nullptr) return;
    const std::size_t before = (*last)->held();
    const bool stays = (*last)->give_way();
    held_ += (*last)->held() - before;
    if (!stays) remove(*last);
  }
}

void ServicePort::wait(int other, std::chrono::nanoseconds longest) {
  now_ = Clock::now();
  const bool accepts = now_ >= accepts_from_;
  polled_.clear();
  polled_.push_back({accepts ? listener_ : -1, POLLIN, 0});
  polled_.push_back({accepts ? local_listener_ : -1, POLLIN, 0});
  polled_.push_back({other, POLLIN, 0});
  polled_.push_back({answer_is_given_->get(), POLLIN, 0});
  for (const std::unique_ptr<ServiceSession>& session : sessions_) {
    polled_.push_back({session->descriptor(), session->events(), 0});
  }
  if (has_work()) longest = std::chrono::nanoseconds::zero();
  // A client that has its answer usually sends its next request soon.
  ServiceSession* const answered = std::exchange(answered_, nullptr);
  const bool is_wait = answered != nullptr && longest >= spin_.limit();
  if (is_wait) {
    const bool is_ready = spin_.poll([&] {
      constexpr timespec kNow{};
      if (++num_polls_ % kMaxCalls != 0) return answered->read_ahead();
      return has_work() || ppoll(polled_.data(), polled_.size(), &kNow, nullptr) > 0;
    });
    if (is_ready) return;
    longest -= Clock::now() - now_;
  }
  if (longest > std::chrono::nanoseconds::zero()) {
    for (const std::unique_ptr<ServiceSession>& session : sessions_) {
      if (!session->may_wait()) longest = std::chrono::nanoseconds::zero();
    }
  }
  constexpr std::int64_t kPerSecond = 1000000000;
  const std::int64_t left = std::max<std::int64_t>(longest.count(), 0);
  const timespec timeout{left / kPerSecond, left % kPerSecond};
  // If a signal interrupts ppoll, all revents stay 0.
  ppoll(polled_.data(), polled_.size(), &timeout, nullptr);
  if (is_wait) spin_.finish();
}

void ServicePort::accept_clients(int listener) {
  constexpr int kMaxAtOnce = 64;  // connected clients do not wait for a burst of new ones
  for (int i = 0; i < kMaxAtOnce; ++i) {
    const int descriptor = accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (descriptor < 0) {
      if (errno == EAGAIN || errno == EINTR || errno == ECONNABORTED) return;
      // Out of descriptors or memory: the listener stays readable, and polling it would spin.
      ROS_ERROR_STREAM("No further client of the services can be accepted: "
                       << std::generic_category().message(errno));
      accepts_from_ = Clock::now() + std::chrono::seconds(1);
      return;
    }
    if (listener == local_listener_) {
      welcome_locally(descriptor);
    } else {
      welcome(descriptor);
    }
  }
}

void ServicePort::welcome(int descriptor) {
  if (is_full()) {
    const std::string why = "the services have " + std::to_string(sessions_.size()) +
                            " clients, and no more are accepted";
    log_client(shared_, "is refused", why);
    tcpros::Bytes header;
    tcpros::append_header({{"error", why}}, header);
    // The client's header may not have arrived yet, but the client waits only for the answer to it.
    send(descriptor, header.data(), header.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    close(descriptor);
    return;
  }
  set(descriptor, IPPROTO_TCP, TCP_NODELAY, 1);
  set(descriptor, SOL_SOCKET, SO_KEEPALIVE, 1);
  set(descriptor, IPPROTO_TCP, TCP_KEEPIDLE, kIdleSeconds);
  set(descriptor, IPPROTO_TCP, TCP_KEEPINTVL, kProbeSeconds);
  set(descriptor, IPPROTO_TCP, TCP_KEEPCNT, kProbes);
  add(Channel(descriptor));
}

/// A client that receives no memory connects to the port, where it learns that the server is full.
void ServicePort::welcome_locally(int descriptor) {
  Channel local(descriptor);
  if (is_full()) return;
  Channel shared = Channel::share(std::move(local));
  if (shared.is_open()) add(std::move(shared));
}

void ServicePort::add(Channel channel) {
  sessions_.push_back(std::make_unique<ServiceSession>(std::move(channel), shared_));
  held_ += sessions_.back()->held();
}

}  // namespace walker
