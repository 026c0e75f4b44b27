#include "wire/master.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <locale>
#include <utility>

#include "base/printable_text.h"
#include "walker_sim/client.h"

namespace walker {
namespace {

// A master's answer has a few hundred bytes.
constexpr std::size_t kMaxBodyBytes = 1 << 20;
constexpr std::size_t kMaxHeadBytes = 1 << 16;

/// Reads an answer in the subset of HTTP/1.0 that masters use.
class HttpReader {
 public:
  HttpReader(Socket& socket, const Deadline& deadline) : socket_(socket), deadline_(deadline) {}

  std::string body() {
    check_status(line());
    std::string length;
    for (std::string field = line(); !field.empty(); field = line()) {
      const std::size_t colon = field.find(':');
      if (colon == std::string::npos) fail("a header field without a colon: " + field);
      const std::string name = lowered(field.substr(0, colon));
      const std::string value = trimmed(field.substr(colon + 1));
      if (name == "transfer-encoding") fail("the transfer encoding " + value + " is not supported");
      if (name != "content-length") continue;
      if (!length.empty() && length != value) {
        fail(std::string("two lengths, ").append(length).append(" and ").append(value));
      }
      length = value;
    }
    return length.empty() ? rest() : take(to_size(length));
  }

 private:
  [[noreturn]] static void fail(const std::string& what) {
    throw std::runtime_error("not an HTTP answer: " + what);
  }

  static std::string lowered(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](char c) { return std::tolower(c, std::locale::classic()); });
    return text;
  }

  static std::string trimmed(const std::string& text) {
    const std::size_t begin = text.find_first_not_of(" \t");
    if (begin == std::string::npos) return "";
    return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
  }

  static void check_status(const std::string& line) {
    const std::size_t blank = line.find(' ');
    if (line.rfind("HTTP/1.", 0) != 0 || blank == std::string::npos) fail("it begins with " + line);
    if (line.compare(blank + 1, 3, "200") != 0) {
      throw std::runtime_error("HTTP status " + line.substr(blank + 1));
    }
  }

  static std::size_t to_size(const std::string& text) {
    std::size_t size = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, size);
    if (error != std::errc() || stop != end) fail("the length \"" + text + "\"");
    if (size > kMaxBodyBytes) fail("a length of " + text + " bytes; must be at most 1 MiB");
    return size;
  }

  /// Reads a line of the header without its end.
  std::string line() {
    std::size_t end = 0;
    while ((end = input_.find('\n')) == std::string::npos) {
      if (head_bytes_ + input_.size() > kMaxHeadBytes) fail("a header of more than 64 KiB");
      if (!receive()) fail("EOF in its header");
    }
    head_bytes_ += end + 1;
    std::string line = input_.substr(0, end);
    input_.erase(0, end + 1);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    return line;
  }

  std::string take(std::size_t size) {
    while (input_.size() < size) {
      if (!receive()) {
        fail("EOF after " + std::to_string(input_.size()) + " of " + std::to_string(size) +
             " bytes");
      }
    }
    return input_.substr(0, size);
  }

  std::string rest() {
    while (receive()) {
      if (input_.size() > kMaxBodyBytes) fail("more than 1 MiB");
    }
    return std::move(input_);
  }

  /// @return false at EOF
  bool receive() {
    std::array<char, 4096> part{};
    const std::size_t size = socket_.receive(part.data(), part.size(), deadline_);
    input_.append(part.data(), size);
    return size > 0;
  }

  Socket& socket_;
  const Deadline& deadline_;
  std::string input_;
  std::size_t head_bytes_ = 0;  // of the header's lines so far
};

/// Posts `body`, an XML document, to a server's root over a new connection. HTTP/1.0 excludes
/// chunked answers.
/// @return the answer's body: Content-Length bytes, or all up to EOF
/// @throws SocketError, Interrupted; std::runtime_error for a malformed answer or non-200 status
std::string http_post(const Endpoint& server, const std::string& body, const Deadline& deadline) {
  Socket socket(server.host, server.port, deadline);
  const bool is_ipv6 = server.host.find(':') != std::string::npos;
  const std::string name = is_ipv6 ? "[" + server.host + "]" : server.host;
  const std::string message =
      "POST / HTTP/1.0\r\nHost: " + name + ":" + std::to_string(server.port) +
      "\r\nContent-Type: text/xml\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" +
      body;
  socket.send_all(message.data(), message.size(), deadline);
  return HttpReader(socket, deadline).body();
}

}  // namespace

Endpoint parse_uri(const std::string& uri, const std::string& scheme) {
  const std::string prefix = scheme + "://";
  const auto fail = [&] {
    throw std::invalid_argument("\"" + uri + "\"; must be " + prefix + "HOST:PORT");
  };
  if (uri.compare(0, prefix.size(), prefix) != 0) fail();
  std::string address = uri.substr(prefix.size());
  if (!address.empty() && address.back() == '/') address.pop_back();
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) fail();
  Endpoint endpoint;
  endpoint.host = address.substr(0, colon);
  if (endpoint.host.front() == '[' && endpoint.host.back() == ']') {
    endpoint.host = endpoint.host.substr(1, endpoint.host.size() - 2);
  }
  if (endpoint.host.empty() || endpoint.host.find_first_of("/[]@ \t\r\n") != std::string::npos) {
    fail();
  }
  const char* const begin = address.data() + colon + 1;
  const char* const end = address.data() + address.size();
  const auto [stop, error] = std::from_chars(begin, end, endpoint.port);
  if (error != std::errc() || stop != end || endpoint.port == 0) fail();
  return endpoint;
}

xml_rpc::Value call_master(const std::string& uri, const std::string& call,
                           const Deadline& deadline, const char* malformed) {
  xml_rpc::Value answer = xml_rpc::parse_answer(http_post(parse_uri(uri, "http"), call, deadline));
  // [code, text, value], where code is 1: success, 0: failure, -1: the caller's error
  using Kind = xml_rpc::Value::Kind;
  if (answer.kind != Kind::array || answer.elements.size() != 3 ||
      answer.elements[0].kind != Kind::integer || answer.elements[1].kind != Kind::text) {
    throw std::runtime_error(malformed);
  }
  if (answer.elements[0].integer != 1) throw MasterRefusal(answer.elements[1].text);
  return std::move(answer.elements[2]);
}

Endpoint look_up_service(const std::string& master_uri, const std::string& name,
                         const Deadline& deadline) {
  const std::string whom = "ROS master " + master_uri + ": ";
  try {
    const xml_rpc::Value uri =
        call_master(master_uri, xml_rpc::make_call("lookupService", {kCallerId, name}), deadline,
                    "its answer to lookupService is not [code, text, URI]");
    return parse_uri(uri.text, "rosrpc");
  } catch (const MasterRefusal& refusal) {
    throw ConnectionError(whom + "it does not know " + name + " (" + printable(refusal.what()) +
                          "): is the server running, under this name, and in a version that has "
                          "this service?");
  } catch (const SocketError& error) {
    throw ConnectionError(whom + error.what() + "; is it running, and is this its ROS_MASTER_URI?");
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    throw ConnectionError(whom + printable(error.what()));
  }
}

}  // namespace walker
