// Users' models: which ones are refused, with which messages, and which ones work.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "error_message.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/other_walker.h"
#include "stepper.h"

namespace walker::mujoco {
namespace {

namespace fs = std::filesystem;

class XmlFileTest : public QuietTest {
 protected:
  static std::string refusal_of_path(const std::string& path) {
    return message_of<std::invalid_argument>([&] { make("Walker2d-v5", {{"xml_file", path}}); });
  }

  /// Returns the error message after the file name, which the message must contain.
  std::string refusal(const std::string& text) const {
    const std::string file = folder_.write("model.xml", text);
    const std::string message = refusal_of_path(file);
    const std::string begin = "parameter xml_file = " + file + ": ";
    EXPECT_EQ(message.rfind(begin, 0), 0U) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message.substr(std::min(begin.size(), message.size()));
  }

  std::string refusal_with(const std::string& from, const std::string& to) const {
    return refusal(replaced(stock_text("walker2d_v5.xml"), from, to));
  }

  void expect_words(const std::string& message, const std::vector<std::string>& words) {
    for (const std::string& word : words) {
      EXPECT_NE(message.find(word), std::string::npos) << word << " is not in: " << message;
    }
  }
};

// ---------------------------------------------------------------- what MuJoCo rejects

TEST_F(XmlFileTest, NamesAMissingFile) {
  for (const std::string& path : {folder_.path("missing.xml"), folder_.path("no/such/folder.xml"),
                                  std::string("walker2d_v3.xml"), std::string()}) {
    const std::string message = refusal_of_path(path);
    expect_words(message, {"parameter xml_file = " + path + ": ", "ile"});
    EXPECT_GT(message.size(), path.size() + 30) << message << ": no reason";
  }
  expect_words(refusal_of_path(folder_.path()), {folder_.path() + ": ", "XML"});
}

TEST_F(XmlFileTest, ReportsMuJoCosErrors) {
  for (const std::string& text :
       {std::string(), std::string("not a model"), std::string("<mujoco><worldbody></mujoco>"),
        std::string(5000, 'x'), std::string("\0\1\2", 3)}) {
    expect_words(refusal(text), {"XML"});
  }
  expect_words(refusal("<html><body/></html>"), {"nrecognized", "html"});
  const struct {
    const char *from, *to;
    std::vector<std::string> words;
  } cases[] = {
      {"<option ", "<opinion ", {"Schema violation", "opinion", "line 1"}},
      {"integrator=\"RK4\"", "integrator=\"RK5\"", {"RK5", "line"}},
      {"joint=\"leg_joint\"", "joint=\"arm_joint\"", {"arm_joint", "line"}},
      {"density=\"1000\"", "density=\"0\"", {"mass and inertia"}},
      {"size=\"0.04 0.25\"", "size=\"-1\"", {"size", "must be positive"}},
      {"<worldbody>", "<include file=\"nothing.xml\"/><worldbody>", {"nothing.xml"}},
      {"name=\"leg\"", "name=\"foot\"", {"foot"}},
      // MuJoCo's default error handler would end the process.
      {"<worldbody>", "<size nstack=\"10\"/><worldbody>", {"tack overflow"}},
  };
  for (const auto& [from, to, words] : cases) expect_words(refusal_with(from, to), words);
}

// ---------------------------------------------------------------- what we reject

/// A change of Gymnasium's model, and the error message.
struct Change {
  const char *from, *to, *message;
};

TEST_F(XmlFileTest, RejectsModelsOfOtherRobots) {
  const char* const root =
      "the first three joints must be the trunk's: slide (x), slide (z), hinge (pitch)";
  const char* const axes = "the trunk must slide along the world's x, then z, and turn about its y";
  const char* const motor = "<motor joint=\"leg_joint\"/>";
  const char* const no_motor = "actuator number 1: must be a motor";
  const Change changes[] = {
      {"type=\"slide\" axis=\"1 0 0\"", "type=\"hinge\" axis=\"1 0 0\"", root},
      {"type=\"slide\" axis=\"0 0 1\"", "type=\"hinge\" axis=\"0 0 1\"", root},
      {"name=\"rooty\"", "name=\"rooty\" type=\"slide\"", root},
      {"name=\"leg_joint\"", "name=\"leg_joint\" type=\"slide\"",
       "joint leg_joint: must be a hinge, and the only joint of its body"},
      {"name=\"rooty\"", "name=\"rooty\" pos=\"0 0 0.1\"",
       "joint rooty: must turn about the trunk's origin (pos 0 0 0)"},
      {"name=\"rooty\" axis=\"0 1 0\"", "name=\"rooty\" axis=\"0 0 1\"", axes},
      {"name=\"rooty\" axis=\"0 1 0\"", "name=\"rooty\" axis=\"0 -1 0\"", axes},
      {"type=\"slide\" axis=\"1 0 0\"", "type=\"slide\" axis=\"0 1 0\"", axes},
      {"type=\"slide\" axis=\"1 0 0\"", "type=\"slide\" axis=\"-1 0 0\"", axes},
      {"type=\"slide\" axis=\"0 0 1\"", "type=\"slide\" axis=\"1 0 0.01\"", axes},
      {"<body name=\"torso\" pos=\"0 0 1.25\"",
       "<body name=\"torso\" pos=\"0 0 1.25\" euler=\"0 10 0\"", axes},
      {motor, "<motor name=\"knee\" joint=\"thigh_joint\"/>",
       "actuator knee: drives a joint that actuator number 0 drives already"},
      {motor, "<motor joint=\"rooty\"/>", "actuator number 1: must drive one of the 6 hinges"},
      {motor, "<motor joint=\"leg_joint\" ctrllimited=\"false\"/>",
       "actuator number 1: must have a ctrlrange"},
      {motor, "<position joint=\"leg_joint\" ctrllimited=\"true\" ctrlrange=\"-1 1\"/>", no_motor},
      {motor, "<velocity joint=\"leg_joint\" ctrllimited=\"true\" ctrlrange=\"-1 1\"/>", no_motor},
      {motor, "<general biastype=\"affine\" joint=\"leg_joint\" ctrllimited=\"true\"/>", no_motor},
      {motor, "<general gaintype=\"affine\" joint=\"leg_joint\" ctrllimited=\"true\"/>", no_motor},
      {motor, "<motor joint=\"leg_joint\" gear=\"0\"/>",
       "actuator number 1: must have a gear other than 0"},
      // Simulation time is in whole nanoseconds and must increase.
      {"timestep=\"0.002\"", "timestep=\"1e-9\"", "timestep = 1e-09 s; must be at least 1e-06 s"},
  };
  for (const auto& [from, to, message] : changes) {
    EXPECT_EQ(refusal_with(from, to), message) << from << " -> " << to;
  }
}

TEST_F(XmlFileTest, RejectsOtherNumbersOfJoints) {
  const std::string stock = stock_text("walker2d_v5.xml");
  const std::string motor = "<motor joint=\"foot_left_joint\"/>";
  const std::pair<std::string, const char*> cases[] = {
      {"<mujoco/>", "nq = 0, nv = 0, nu = 0, na = 0"},
      {without(stock, "<motor joint=\"leg_joint\"", "/>"), "nq = 9, nv = 9, nu = 5, na = 0"},
      {replaced(stock, motor, "<general joint=\"foot_left_joint\" dyntype=\"filter\"/>"),
       "nq = 9, nv = 9, nu = 6, na = 1"},
      {replaced(other_walker_text(), "<worldbody>",
                "<worldbody><body><freejoint/><geom size=\"1\"/></body>"),
       "nq = 16, nv = 15, nu = 6, na = 0"},
      {replaced(replaced(stock, motor, ""), "name=\"foot_left_joint\" ",
                "name=\"b\" type=\"ball\" limited=\"false\" "),
       "nq = 12, nv = 11, nu = 5, na = 0"},
  };
  for (const auto& [text, sizes] : cases) {
    EXPECT_EQ(refusal(text), sizes + std::string("; must be nq = nv = 9, nu = 6, na = 0, as in ") +
                                 "walker2d_v5.xml");
  }
}

TEST_F(XmlFileTest, RejectsJointsOnOtherBodies) {
  const std::string stock = stock_text("walker2d_v5.xml");
  const std::string pitch = "<joint class=\"root\" name=\"rooty\" axis=\"0 1 0\"/>";
  const std::string two_bodies =
      replaced(replaced(stock, pitch, "<geom size=\"0.1 0.1\"/><body name=\"upper\">" + pitch),
               "</worldbody>", "</body></worldbody>");
  EXPECT_EQ(refusal(two_bodies),
            "the first three joints must be the trunk's: slide (x), slide (z), hinge (pitch)");

  const std::string foot = "<joint name=\"foot_joint\" pos=\"-0.2 0 0.1\" range=\"-45 45\"/>";
  const std::string two_joints =
      replaced(replaced(stock, foot, ""), "<geom name=\"leg_geom\"",
               "<joint name=\"foot_joint\" range=\"-45 45\"/><geom name=\"leg_geom\"");
  EXPECT_EQ(refusal(two_joints),
            "joint leg_joint: must be a hinge, and the only joint of its body");

  // A lever beside the walker would have no parent in the specification.
  const std::string lever =
      replaced(without(stock, "<joint name=\"foot_left_joint\"", "/>"), "</worldbody>",
               "<body name=\"lever\"><joint name=\"foot_left_joint\" range=\"0 1\"/>"
               "<geom size=\"0.1 0.1\"/></body></worldbody>");
  EXPECT_EQ(refusal(lever), "joint foot_left_joint: must carry a limb of the trunk");

  const std::string tendon = replaced(
      replaced(stock, "<actuator>",
               "<tendon><fixed name=\"t\"><joint joint=\"leg_joint\" coef=\"1\"/></fixed></tendon>"
               "<actuator>"),
      "<motor joint=\"leg_joint\"/>", "<motor tendon=\"t\"/>");
  EXPECT_EQ(refusal(tendon), "actuator number 1: must drive one of the 6 hinges");
}

/// MuJoCo would work for hours or overflow its stack.
TEST_F(XmlFileTest, RejectsSettingsOutOfRange) {
  const struct {
    const char *setting, *reason;
  } cases[] = {
      {"<option iterations='2147483647' tolerance='0'/>",
       "option iterations = 2147483647: must be in [0, 10000]"},
      {"<option noslip_iterations='10001'/>",
       "option noslip_iterations = 10001: must be in [0, 10000]"},
      {"<option mpr_iterations='10001'/>", "option mpr_iterations = 10001: must be in [0, 10000]"},
      {"<visual><global offwidth='2147483647'/></visual>",
       "global offwidth = 2147483647: must be in [1, 16384]"},
      {"<visual><global offheight='0'/></visual>", "global offheight = 0: must be in [1, 16384]"},
      {"<visual><quality shadowsize='2147483647'/></visual>",
       "quality shadowsize = 2147483647: must be in [0, 16384]"},
      {"<visual><quality offsamples='-1'/></visual>",
       "quality offsamples = -1: must be in [0, 64]"},
      {"<visual><quality numslices='100000'/></visual>",
       "quality numslices = 100000: must be in [1, 1000]"},
      {"<visual><quality numstacks='0'/></visual>", "quality numstacks = 0: must be in [1, 1000]"},
      {"<visual><quality numquads='1001'/></visual>",
       "quality numquads = 1001: must be in [1, 1000]"},
  };
  for (const auto& one : cases) {
    EXPECT_EQ(refusal_with("<worldbody>", std::string(one.setting) + "<worldbody>"), one.reason);
  }
}

// ---------------------------------------------------------------- what works

/// sensors_test.cpp steps it.
TEST_F(XmlFileTest, MakesAnotherWalker) {
  const auto walker =
      make("Walker2d-v5", {{"xml_file", folder_.write("m.xml", other_walker_text())}});
  const Specification& specification = walker->specification();
  EXPECT_EQ(specification.observation_size(), 17U);
  EXPECT_EQ(specification.action_low, (std::vector<double>{-1, -0.4F, -2, -1, -1, -1}));
  EXPECT_EQ(specification.action_high, (std::vector<double>{1, 1.2F, -1, 1, 1, 1}));
  EXPECT_EQ(specification.effort_per_action, (std::vector<double>{-30, 50, 10, 50, 20, 7}));
  EXPECT_EQ(specification.dt, 0.003 * 4);
}

TEST_F(XmlFileTest, RefusesWorldsOfBodiesAndFloorsThatItsModelLacks) {
  const std::string file = folder_.write("m.xml", other_walker_text());
  const auto walker = make("Walker2d-v5", {{"xml_file", file}});
  for (const auto& [name, reason] :
       {std::pair("torso_mass", "the model has no body torso"),
        {"torso_force_x", "the model has no link torso"},
        {"floor_friction", "the model has no floor, a level plane of the world's body"}}) {
    const World world{{name, {1, 1}}};
    EXPECT_EQ(message_of<std::invalid_argument>([&] { walker->set_world(world); }),
              std::string("world parameter ") + name +
                  ": cannot be applied; parameter xml_file = " + file + ": " + reason);
  }
}

/// For a hinge, MuJoCo computes the same torque in both frames.
TEST_F(XmlFileTest, AcceptsMotorsInTheParentsFrame) {
  const std::string text = stock_text("walker2d_v5.xml");
  Stepper stock("Walker2d-v5", {{"xml_file", folder_.write("m.xml", text)}});
  Stepper turned("Walker2d-v5",
                 {{"xml_file", folder_.write("n.xml", replaced(text, "<motor joint",
                                                               "<motor jointinparent"))}});
  EXPECT_EQ(turned.environment->specification().effort_per_action,
            stock.environment->specification().effort_per_action);
  stock.reset(1);
  turned.reset(1);
  while (!stock.has_ended()) {
    stock.step({1, 0.5, 0, -0.5, -1, 0.25});
    turned.step({1, 0.5, 0, -0.5, -1, 0.25});
    EXPECT_EQ(stock.row(), turned.row());
  }
}

TEST_F(XmlFileTest, AcceptsAnyPath) {
  const std::string text = builtin_text("walker2d_v4.xml");
  fs::create_directory(folder_.path("pfad mit \xc3\xa4\xc3\xb6\xc3\xbc"));
  const std::string odd =
      folder_.write("pfad mit \xc3\xa4\xc3\xb6\xc3\xbc/l\xc3\xa4ufer 1%s.xml", text);
  EXPECT_EQ(refusal_of_path(odd), "nothing thrown");
  const fs::path old = fs::current_path();
  fs::current_path(folder_.path());
  folder_.write("plain.xml", text);
  EXPECT_EQ(refusal_of_path("plain.xml"), "nothing thrown");
  EXPECT_EQ(refusal_of_path("./plain.xml"), "nothing thrown");
  fs::current_path(old);
}

/// Included files are relative to the including file, not to the working directory.
TEST_F(XmlFileTest, FindsIncludesBesideTheFile) {
  const std::string text = stock_text("walker2d_v5.xml");
  const std::string begin = "<actuator>";
  const std::string motors =
      text.substr(text.find(begin), text.find("</mujoco>") - text.find(begin));
  folder_.write("motors.xml", "<mujocoinclude>" + motors + "</mujocoinclude>");
  const std::string file =
      folder_.write("main.xml", replaced(text, motors, "<include file=\"motors.xml\"/>"));
  EXPECT_EQ(refusal_of_path(file), "nothing thrown");
}

TEST_F(XmlFileTest, ExpandsTheHomeFolder) {
  const char* const home = std::getenv("HOME");
  const std::string old = home == nullptr ? "" : home;
  setenv("HOME", folder_.path().c_str(), 1);
  folder_.write("walker.xml", builtin_text("walker2d_v5.xml"));
  EXPECT_EQ(refusal_of_path("~/walker.xml"), "nothing thrown");
  expect_words(refusal_of_path("~/missing.xml"), {"parameter xml_file = ~/missing.xml: "});
  if (home == nullptr) {
    unsetenv("HOME");
  } else {
    setenv("HOME", old.c_str(), 1);
  }
}

// ---------------------------------------------------------------- sharing

TEST_F(XmlFileTest, EnvironmentsShareAModel) {
  EXPECT_EQ(load_model("walker2d_v5.xml"), load_model("walker2d_v5.xml"));
  EXPECT_NE(load_model("walker2d_v4.xml"), load_model("walker2d_v5.xml"));
  const std::string file = folder_.write("m.xml", other_walker_text());
  const ModelPointer model = load_model(file);
  EXPECT_EQ(load_model(file), model);
  const long users = model.use_count();
  const auto first = make("Walker2d-v5", {{"xml_file", file}});
  const long with_first = model.use_count();
  EXPECT_GT(with_first, users);
  const auto second = make("Walker2d-v5", {{"xml_file", file}});
  EXPECT_GT(model.use_count(), with_first);
  const std::weak_ptr<const mjModel> unused = load_model(folder_.write("n.xml", "<mujoco/>"));
  EXPECT_TRUE(unused.expired());
}

TEST_F(XmlFileTest, CompilesAChangedFileAgain) {
  const std::string text = builtin_text("walker2d_v5.xml");
  const std::string file = folder_.write("m.xml", text);
  const auto old = make("Walker2d-v5", {{"xml_file", file}});
  folder_.write("m.xml", replaced(text, "gear=\"100\"", "gear=\"70\""));
  fs::last_write_time(file, fs::last_write_time(file) + std::chrono::seconds(1));
  const auto changed = make("Walker2d-v5", {{"xml_file", file}});
  EXPECT_EQ(old->specification().effort_per_action[0], 100);
  EXPECT_EQ(changed->specification().effort_per_action[0], 70);
  folder_.write("m.xml", "<mujoco/>");
  EXPECT_NE(refusal_of_path(file), "nothing thrown");
  folder_.write("m.xml", text);
  EXPECT_EQ(refusal_of_path(file), "nothing thrown");
  fs::remove(file);
  expect_words(refusal_of_path(file), {file});
}

}  // namespace
}  // namespace walker::mujoco
