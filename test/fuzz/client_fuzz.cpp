// A whole client with an untrusted server, which sends one piece after each connection header and
// each request. The master's answers are valid. Covers connection headers and all answers.
#include "walker_sim/client.h"

#include <string>

#include "fuzz/input.h"
#include "fuzz/scripted_socket.h"
#include "fuzz/target.h"

namespace walker::fuzz {
namespace {

std::vector<std::uint8_t> lookup_answer() {
  const std::string body =
      "<?xml version='1.0'?><methodResponse><params><param><value><array><data><value><int>1</int>"
      "</value><value><string>rosrpc</string></value><value><string>rosrpc://localhost:4000</"
      "string>"
      "</value></data></array></value></param></params></methodResponse>";
  const std::string answer =
      "HTTP/1.1 200 OK\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
  return {answer.begin(), answer.end()};
}

/// Calls while the peers send `pieces`. @return whether the call succeeded
template <typename Call>
bool try_call(Pieces pieces, const Call& call) {
  script() = std::move(pieces);
  try {
    call();
    return true;
  } catch (const ConnectionError& refusal) {
    accept(refusal);
  } catch (const RequestRefused& refusal) {
    accept(refusal);
  }
  return false;
}

void check_image(const Image& image) {
  const std::size_t pixels = std::size_t{image.width} * image.height;
  require(image.rgb.size() + image.depth.size() == (image.depth.empty() ? 3 * pixels : pixels),
          "the size of an image is that of its pixels");
}

void run(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  // The first call of a service reads three pieces: the master's answer, a header, an answer.
  const auto try_first = [&](const auto& call) {
    const std::vector<std::uint8_t> header = input.piece();
    return try_call({lookup_answer(), header, input.piece()}, call);
  };
  ClientOptions options;
  options.master_uri = "http://localhost:11311";
  std::unique_ptr<Client> client;
  if (!try_first([&] { client = std::make_unique<Client>(options); })) return;
  Transition transition;
  BatchTransition batch;
  RepeatedStep repeated;
  BatchReset reset;
  Image image;
  Reset reset_to;
  std::vector<std::uint8_t> record;
  const std::vector<double> action(4);
  const auto step = [&] { client->step(action.data(), action.size(), transition); };
  try_first([&] { client->reset(1, World{{"gravity", {-2, -1}}}, reset_to); });
  try_first(step);
  try_call({input.piece()}, step);
  if (try_first([&] { client->step_many(action.data(), action.size(), 2, repeated); })) {
    require(repeated.steps == 1 || repeated.steps == 2, "at most the requested steps are made");
  }
  try_first([&] { client->snapshot(record); });
  try_first([&] { client->set_world({}, {World{}}); });
  try_first([&] { client->set_state(0, action, action, transition); });
  try_first([&] { client->reset_batch({}, {}, reset); });
  if (try_first([&] { client->step_batch(action.data(), action.size(), batch); })) {
    require(batch.final_environments.size() <= batch.rewards.size(), "each episode ends once");
  }
  try_first([&] { client->render(0, "rgb8", {}, image); });
  check_image(image);
  try_call({input.piece()}, [&] { client->render(0, "32FC1", {}, image); });
  check_image(image);
}

const Registered kTarget("client", run);

}  // namespace
}  // namespace walker::fuzz
