// Scripted TCP peers for the client, for any protocol, on the loopback interface.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/posix.h"
#include "wire/tcpros.h"

namespace walker::test {

class Peer {
 public:
  explicit Peer(int descriptor) : descriptor_(descriptor) {}
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  ~Peer() { close(descriptor_); }

  /// Fills `data`. @return false on EOF
  bool take(std::string& data) {
    if (data.empty()) return true;  // recv would block
    const ssize_t got = recv(descriptor_, data.data(), data.size(), MSG_WAITALL);
    return got == static_cast<ssize_t>(data.size());
  }

  /// @return an empty string on EOF
  std::string take(std::size_t size) {
    std::string data(size, '\0');
    return take(data) ? data : "";
  }

  void give(const std::string& data) { send(descriptor_, data.data(), data.size(), MSG_NOSIGNAL); }

  /// Blocks until the client's next byte or EOF. @return whether it was EOF
  bool sees_end() { return take(1).empty(); }

  bool has_ended() {
    char next = 0;
    return recv(descriptor_, &next, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
  }

  /// Reads a TCPROS frame and returns its payload.
  std::string take_frame() {
    const std::string length = take(4);
    if (length.size() < 4) return "";
    return take(tcpros::load_length(reinterpret_cast<const std::uint8_t*>(length.data())));
  }

  std::string take_post() {
    std::string head;
    while (head.find("\r\n\r\n") == std::string::npos) {
      const std::string next = take(1);
      if (next.empty()) return "";
      head += next;
    }
    const std::string field = "Content-Length: ";
    return take(std::stoul(head.substr(head.find(field) + field.size())));
  }

 private:
  int descriptor_;
};

/// Listens and plays one script per connection, in order, in its own thread.
class ScriptedServer {
 public:
  using Script = std::function<void(Peer&)>;

  explicit ScriptedServer(std::vector<Script> scripts)
      : listener_(checked(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket")) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    auto* const place = reinterpret_cast<sockaddr*>(&address);
    checked(bind(listener_, place, size), "bind");
    checked(listen(listener_, SOMAXCONN), "listen");
    checked(getsockname(listener_, place, &size), "getsockname");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this, scripts = std::move(scripts)] {
      for (const Script& script : scripts) {
        const int descriptor = accept(listener_, nullptr, nullptr);
        if (descriptor < 0) return;  // the destructor has shut the listener down
        Peer peer(descriptor);
        script(peer);
      }
    });
  }
  ScriptedServer(const ScriptedServer&) = delete;
  ScriptedServer& operator=(const ScriptedServer&) = delete;
  ~ScriptedServer() {
    shutdown(listener_, SHUT_RDWR);  // ends accept() for scripts without a connection
    thread_.join();
    close(listener_);
  }

  std::uint16_t port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  int listener_;
  std::uint16_t port_ = 0;
  std::thread thread_;
};

inline std::uint16_t dead_port() { return ScriptedServer({}).port(); }

inline std::string http_answer(const std::string& body) {
  return "HTTP/1.1 200 OK\r\nServer: test\r\nContent-Type: text/xml\r\nContent-length: " +
         std::to_string(body.size()) + "\r\n\r\n" + body;
}

inline std::string xml_answer(int code, const std::string& text, const std::string& value) {
  return "<?xml version='1.0'?>\n<methodResponse>\n<params>\n<param>\n<value><array><data>\n"
         "<value><int>" +
         std::to_string(code) + "</int></value>\n<value><string>" + text +
         "</string></value>\n<value><string>" + value +
         "</string></value>\n</data></array></value>\n</param>\n</params>\n</methodResponse>\n";
}

/// Script of a master that does not know the service.
inline ScriptedServer::Script unknowing_master(const std::string& reason) {
  return [reason](Peer& peer) {
    peer.take_post();
    peer.give(http_answer(xml_answer(-1, reason, "")));
  };
}

/// Script of a master that answers one look-up with this address.
inline ScriptedServer::Script master_of(const std::string& address) {
  return [address](Peer& peer) {
    peer.take_post();
    peer.give(http_answer(xml_answer(1, "rosrpc URI", "rosrpc://" + address)));
  };
}

class Message {
 public:
  template <typename Number>
  Message& number(Number value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
    return *this;
  }
  Message& text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
    return *this;
  }
  template <typename Number>
  Message& array(const std::vector<Number>& values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const Number& value : values) number(value);
    return *this;
  }
  Message& texts(const std::vector<std::string>& values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const std::string& value : values) text(value);
    return *this;
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

inline std::string framed(const std::string& body) { return Message().text(body).bytes(); }

inline std::string header(const tcpros::Fields& fields) {
  tcpros::Bytes bytes;
  tcpros::append_header(fields, bytes);
  return {bytes.begin(), bytes.end()};
}

/// Frame of a service response: `ok` 1 with the serialized response, 0 with an error message.
inline std::string answer(const std::string& body, char ok = 1) { return ok + framed(body); }

}  // namespace walker::test
