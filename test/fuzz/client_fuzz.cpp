// A whole client with an untrusted server, which sends one piece after each connection header and
// each request. The master's answers are valid.
#include "walker_sim/client.h"

#include <string>

#include "fuzz/input.h"
#include "fuzz/scripted_socket.h"
#include "fuzz/target.h"

namespace walker::fuzz {
namespace {

std::vector<std::uint8_t> address_of_service() {
  const std::string body =
      "<?xml version='1.0'?><methodResponse><params><param><value><array><data><value><int>1</int>"
      "</value><value><string>rosrpc</string></value><value><string>rosrpc://localhost:4000</"
      "string>"
      "</value></data></array></value></param></params></methodResponse>";
  const std::string answer =
      "HTTP/1.1 200 OK\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
  return {answer.begin(), answer.end()};
}

/// The first call of a service reads three pieces: the master's answer, a header, an answer.
template <typename Call>
void try_call(Input& input, const Call& call) {
  script() = {address_of_service(), input.piece(), input.piece()};
  try {
    call();
  } catch (const ConnectionError& refusal) {
    accept(refusal);
  } catch (const RequestRefused& refusal) {
    accept(refusal);
  }
}

void run(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  ClientOptions options;
  options.master_uri = "http://localhost:11311";
  std::unique_ptr<Client> client;
  try_call(input, [&] { client = std::make_unique<Client>(options); });
  if (!client) return;
  Transition transition;
  BatchTransition batch;
  RepeatedStep repeated;
  BatchReset reset;
  Image image;
  std::vector<std::uint8_t> record;
  const std::vector<double> action(4);
  try_call(input, [&] { client->reset(1, transition); });
  try_call(input, [&] { client->step(action.data(), action.size(), transition); });
  script() = {input.piece()};
  try {
    client->step(action.data(), action.size(), transition);
  } catch (const ConnectionError& refusal) {
    accept(refusal);
  } catch (const RequestRefused& refusal) {
    accept(refusal);
  }
  try_call(input, [&] { client->step_many(action.data(), action.size(), 2, repeated); });
  try_call(input, [&] { client->snapshot(record); });
  try_call(input, [&] { client->reset_batch({}, {}, reset); });
  try_call(input, [&] { client->step_batch(action.data(), action.size(), batch); });
  try_call(input, [&] { client->render(0, "rgb8", {}, image); });
}

const Registered kTarget("client", run);

}  // namespace
}  // namespace walker::fuzz
