#include "server/time/master_calls.h"

#include <functional>
#include <stdexcept>
#include <utility>

#include "client/http.h"
#include "client/master.h"

namespace walker {

xml_rpc::Value call_master(const std::string& uri, const std::string& call,
                           std::chrono::steady_clock::duration longest) {
  const Endpoint master = parse_uri(uri, "http");
  const std::function<bool()> never;
  const Patience patience{std::chrono::steady_clock::now() + longest, never};
  xml_rpc::Value answer =
      xml_rpc::parse_answer(http_post(master.host, master.port, call, patience));
  // [code, text, value]: 1 success
  using Kind = xml_rpc::Value::Kind;
  if (answer.kind != Kind::array || answer.elements.size() != 3 ||
      answer.elements[0].kind != Kind::integer) {
    throw std::runtime_error("its answer is not [code, text, value]");
  }
  if (answer.elements[0].integer != 1) throw std::runtime_error(answer.elements[1].text);
  return std::move(answer.elements[2]);
}

}  // namespace walker
