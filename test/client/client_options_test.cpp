// The client's options: their checks and defaults.
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>

#include "client/scripted_server.h"
#include "client/scripted_walker.h"
#include "error_message.h"
#include "walker_sim/client.h"

namespace walker::test {
namespace {

std::string option_error(const ClientOptions& options) {
  return message_of<std::invalid_argument>([&] { Client client(options); });
}

TEST(ClientOptions, AreChecked) {
  for (const char* server : {"", "/", "walker_sim", "/walker_sim/"}) {
    ClientOptions options;
    options.server = server;
    EXPECT_EQ(option_error(options), "server = \"" + std::string(server) +
                                         "\"; must be a node's full name, e.g. /walker_sim");
  }
  for (const double timeout : {0.0, -1.0, 1e7, std::numeric_limits<double>::quiet_NaN()}) {
    ClientOptions options;
    options.timeout = timeout;
    EXPECT_EQ(option_error(options),
              "timeout = " + std::to_string(timeout) + " s; must be above 0 and at most 1000000");
  }
  ClientOptions options;
  options.master_uri = "localhost:11311";
  EXPECT_EQ(option_error(options), "master_uri = \"localhost:11311\"; must be http://HOST:PORT");
}

TEST(ClientOptions, AcceptAShortName) {
  ScriptedServer server({tell_specification});
  ScriptedServer master({master_of(server.address())});
  ClientOptions options = options_for(master);
  options.server = "/a";
  EXPECT_NO_THROW(Client{options});
}

TEST(ClientOptions, DefaultToTheMasterOfTheEnvironment) {
  const char* const set = std::getenv("ROS_MASTER_URI");
  const std::string before = set != nullptr ? set : "";
  setenv("ROS_MASTER_URI", "nonsense", 1);
  EXPECT_EQ(option_error({}), "ROS_MASTER_URI = \"nonsense\"; must be http://HOST:PORT");
  ScriptedServer server({tell_specification});
  ScriptedServer master({master_of(server.address())});
  setenv("ROS_MASTER_URI", ("http://" + master.address()).c_str(), 1);
  EXPECT_NO_THROW(Client());
  if (set != nullptr) {
    setenv("ROS_MASTER_URI", before.c_str(), 1);
  } else {
    unsetenv("ROS_MASTER_URI");
  }
}

}  // namespace
}  // namespace walker::test
