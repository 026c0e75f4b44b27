// Models that make MuJoCo's compiler crash, exit, exhaust the memory or block.
#include "robots/mujoco/compile_apart.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "base/interruption.h"
#include "error_message.h"
#include "robots/mujoco/engine.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"

namespace walker::mujoco {
namespace {

namespace fs = std::filesystem;

CompileLimits small_limits() {
  CompileLimits limits;
  limits.memory = std::size_t{512} << 20U;
  limits.idle_seconds = 2;
  limits.elements = 1000000;
  return limits;
}

class CompileApartTest : public testing::Test {
 protected:
  void SetUp() override {
    load_model("walker2d_v5.xml");  // installs handlers for MuJoCo's errors
    fs::current_path(folder_.path());
  }

  void TearDown() override {
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
    EXPECT_EQ(errno, ECHILD);
    EXPECT_FALSE(fs::exists("MUJOCO_LOG.TXT"));
    fs::current_path(home_);
  }

  /// Returns the error message, or "nothing thrown".
  std::string refusal(const std::string& text, const CompileLimits& limits = small_limits()) const {
    const std::string file = folder_.write("model.xml", text);
    return message_of<std::runtime_error>([&] { compile_apart(file, limits); });
  }

  void write_file(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_.path(name), std::ios::binary) << bytes;
  }

  static bool has(const std::string& text, const std::string& words) {
    return text.find(words) != std::string::npos;
  }

  Folder folder_;
  const std::string walker_ = folder_.write("walker.xml", builtin_text("walker2d_v5.xml"));

 private:
  fs::path home_ = fs::current_path();
};

std::string bytes_of(std::initializer_list<std::int32_t> numbers) {
  std::string bytes;
  for (const std::int32_t number : numbers) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
  }
  return bytes;
}

TEST_F(CompileApartTest, NoSizeEndsThisProcess) {
  write_file("hills.bin", bytes_of({100000, 100000, 0}));
  write_file("negative.bin", bytes_of({-5, -5, 0}));
  write_file("mesh.stl", std::string(80, ' ') + bytes_of({2147483647}));
  write_file("mesh.msh", bytes_of({2147483647, 2147483647, 2147483647, 2147483647}));
  write_file(
      "picture.png",
      std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\2\0\0\0", 29) +
          std::string(100, 'x'));
  fs::create_symlink("/dev/zero", "zeros.stl");
  const std::string most = "2147483647";
  const std::string mesh = "<worldbody><geom type='mesh' mesh='m'/></worldbody>";
  const std::string field = "<worldbody><geom type='hfield' hfield='h'/></worldbody>";
  const std::vector<std::string> models = {
      "<size nuser_body='" + most + "'/>",
      "<size nuser_geom='" + most + "'/><worldbody><geom size='1'/></worldbody>",
      "<size nuser_jnt='" + most +
          "'/><worldbody><body><joint/><geom size='1'/></body></worldbody>",
      "<size nstack='" + most + "'/>",
      "<size njmax='" + most + "' nconmax='" + most + "'/>",
      "<size nconmax='" + most + "'/>",
      "<size nkey='" + most + "'/>",
      "<size nuserdata='" + most + "'/>",
      "<asset><hfield name='h' nrow='100000' ncol='100000' size='1 1 1 1'/></asset>" + field,
      "<asset><hfield name='h' nrow='46341' ncol='46341' size='1 1 1 1'/></asset>",
      "<asset><hfield name='h' file='hills.bin' size='1 1 1 1'/></asset>",
      "<asset><hfield name='h' file='negative.bin' size='1 1 1 1'/></asset>",
      "<asset><texture name='t' type='2d' builtin='flat' width='60000' height='60000'/></asset>",
      "<asset><texture name='t' type='cube' builtin='flat' width='30000' height='30000'/></asset>",
      "<asset><texture name='t' type='2d' file='picture.png'/></asset>",
      "<asset><mesh name='m' file='mesh.stl'/></asset>" + mesh,
      "<asset><mesh name='m' file='mesh.msh'/></asset>" + mesh,
      "<asset><mesh name='m' file='zeros.stl'/></asset>" + mesh,
      "<asset><hfield name='h' file='zeros.stl' size='1 1 1 1'/></asset>",
      "<include file='zeros.stl'/>",
      std::string("<worldbody><body><composite type='grid' count='100000 100000 1' spacing='1'>") +
          "<geom size='.1'/></composite></body></worldbody>",
  };
  for (const std::string& content : models) {
    const std::string message = refusal("<mujoco>" + content + "</mujoco>");
    EXPECT_NE(message, "nothing thrown") << content;
    EXPECT_GT(message.size(), 10U) << content;
  }
}

TEST_F(CompileApartTest, DepthEndsNoProcess) {
  std::string deep = "<mujoco><worldbody>";
  for (int i = 0; i < 100000; ++i) deep += "<body><geom size='1'/>";
  for (int i = 0; i < 100000; ++i) deep += "</body>";
  EXPECT_NE(refusal(deep + "</worldbody></mujoco>"), "nothing thrown");
  write_file("model.xml", "");
  EXPECT_NE(refusal("<mujoco><include file='model.xml'/></mujoco>"), "nothing thrown");
}

TEST_F(CompileApartTest, APipeIsNotWaitedFor) {
  const std::string pipe = folder_.path("pipe.stl");
  ASSERT_EQ(mkfifo(pipe.c_str(), S_IRUSR | S_IWUSR), 0);
  for (const char* content : {"<include file='pipe.stl'/>",
                              "<asset><mesh name='m' file='pipe.stl'/></asset>"
                              "<worldbody><geom type='mesh' mesh='m'/></worldbody>",
                              "<asset><hfield name='h' file='pipe.stl' size='1 1 1 1'/></asset>"}) {
    EXPECT_EQ(refusal("<mujoco>" + std::string(content) + "</mujoco>"),
              "it waited for 2 s for a file that does not come: files must be regular ones");
  }
  EXPECT_TRUE(has(message_of<std::invalid_argument>([&] { load_model(pipe); }),
                  "/pipe.stl: must be an XML file, and a regular one"));
  EXPECT_TRUE(has(message_of<std::invalid_argument>([&] { load_model("/dev/zero"); }),
                  "/dev/zero: must be an XML file, and a regular one"));
}

TEST_F(CompileApartTest, AFileIsNotTooLarge) {
  const std::string file = folder_.write("model.xml", "");
  fs::resize_file(file, (std::uintmax_t{64} << 20U) + 1);
  EXPECT_TRUE(has(message_of<std::invalid_argument>([&] { load_model(file); }),
                  ": has 67108865 bytes; must have at most 67108864"));
}

/// MuJoCo's compile time is quadratic in the number of elements: 100,000 take a minute.
TEST_F(CompileApartTest, AModelHasNotTooManyElements) {
  const auto geoms = [](std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) text += "<geom size='1'/>";
    return text;
  };
  const std::size_t max = CompileLimits{}.elements;
  EXPECT_EQ(max, 20000U);
  const std::string begin = "<mujoco><worldbody>";
  const std::string end = "</worldbody></mujoco>";
  const std::string too_many = "has " + std::to_string(max + 1) +
                               " elements, included files counted; must have at most " +
                               std::to_string(max);
  EXPECT_EQ(refusal(begin + geoms(max - 1) + end, {}), too_many);
  EXPECT_EQ(refusal(begin + geoms(max - 2) + "<!-- " + geoms(9) + "-->" + end, {}),
            "nothing thrown");
  // <worldbody>, <mujoco>, <include> and <mujocoinclude> count as elements.
  write_file("geoms.xml", "<mujocoinclude>" + geoms(max - 4) + "</mujocoinclude>");
  EXPECT_EQ(refusal(begin + "<include file='geoms.xml'/>" + end, {}), "nothing thrown");
  EXPECT_EQ(refusal(begin + "<geom size='1'/><include\n file = \"geoms.xml\" />" + end, {}),
            too_many);
}

TEST_F(CompileApartTest, IncludedFilesAreNotTooLarge) {
  CompileLimits limits = small_limits();
  limits.bytes = 1000;
  write_file("large.xml", "<mujocoinclude/>" + std::string(1000, ' '));
  EXPECT_EQ(refusal("<mujoco><include file='large.xml'/></mujoco>", limits),
            "has, included files counted, more than 1000 bytes");
}

TEST_F(CompileApartTest, APathEndsAtNoZeroByte) {
  const std::string message =
      message_of<std::invalid_argument>([&] { load_model(walker_ + std::string("\0junk", 5)); });
  EXPECT_TRUE(has(message, "walker.xml\\x00junk: must not have a zero byte")) << message;
}

TEST_F(CompileApartTest, AModelIsTheSameAsCompiledHere) {
  for (const char* name : {"walker2d_v4.xml", "walker2d_v5.xml", "hopper_v5.xml"}) {
    const std::string file = folder_.write("model.xml", builtin_text(name));
    EXPECT_EQ(fingerprint(*load_model(file)), fingerprint(*load_model(name))) << name;
  }
}

TEST_F(CompileApartTest, AnOpenFileIsTheOneOfThisProcess) {
  const std::vector<std::byte> expected = compile_apart(walker_);
  const int file = open(walker_.c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_GE(file, 0);
  for (const char* folder : {"/dev/fd/", "/proc/self/fd/"}) {
    EXPECT_EQ(compile_apart(folder + std::to_string(file)), expected) << folder;
  }
  close(file);
}

TEST_F(CompileApartTest, ThreadsMayCompileAtOnce) {
  std::vector<std::thread> threads;
  std::vector<std::size_t> sizes(4);
  threads.reserve(sizes.size());
  for (std::size_t& size : sizes) {
    threads.emplace_back([&] { size = compile_apart(walker_).size(); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::size_t size : sizes) EXPECT_EQ(size, sizes[0]);
  EXPECT_GT(sizes[0], 0U);
}

/// A daemon may have closed descriptors 0 to 2; the pipe to the child then reuses them.
TEST_F(CompileApartTest, StandardDescriptorsMayBeClosed) {
  constexpr unsigned kCombinations = 8;
  for (unsigned closed = 1; closed < kCombinations; ++closed) {
    std::array<int, 3> saved{};
    for (int standard = 0; standard <= STDERR_FILENO; ++standard) {
      if ((closed >> static_cast<unsigned>(standard) & 1U) == 0) continue;
      saved[standard] = fcntl(standard, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
      ::close(standard);
    }
    const std::string message = message_of<std::runtime_error>([&] { compile_apart(walker_); });
    for (int standard = 0; standard <= STDERR_FILENO; ++standard) {
      if (saved[standard] == 0) continue;
      dup2(saved[standard], standard);
      ::close(saved[standard]);
    }
    EXPECT_EQ(message, "nothing thrown") << "closed: " << closed;
  }
}

/// The host's poll throws. TearDown checks that no child is left.
TEST_F(CompileApartTest, ACompilationIsInterrupted) {
  const std::string pipe = folder_.path("pipe.xml");
  ASSERT_EQ(mkfifo(pipe.c_str(), S_IRUSR | S_IWUSR), 0);
  const std::string file =
      folder_.write("model.xml", "<mujoco><include file='pipe.xml'/></mujoco>");
  static std::atomic<bool> is_interrupted{false};  // NOLINT
  is_interrupted = false;
  set_poll([](pollfd* files, nfds_t num_files, int timeout) {
    if (is_interrupted) throw Interrupted();
    return ::poll(files, num_files, timeout);
  });
  int writer = -1;
  std::thread interruption([&] {
    writer = ::open(pipe.c_str(), O_WRONLY | O_CLOEXEC);  // blocks until the child reads
    is_interrupted = true;
  });
  EXPECT_THROW(load_model(file), Interrupted);
  interruption.join();
  set_poll(&::poll);
  ::close(writer);
}

/// A host's interval timer may interrupt every wait.
TEST_F(CompileApartTest, SignalsDoNotUseUpTheIdleTime) {
  const auto before = std::signal(SIGALRM, [](int) {});
  const itimerval often{{0, 1000}, {0, 1000}};
  const itimerval never{};
  setitimer(ITIMER_REAL, &often, nullptr);
  const std::string message = message_of<std::runtime_error>([&] { compile_apart(walker_); });
  setitimer(ITIMER_REAL, &never, nullptr);
  std::signal(SIGALRM, before);
  EXPECT_EQ(message, "nothing thrown");
}

TEST_F(CompileApartTest, AHostThatWantsNoChildrenMayCompile) {
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  EXPECT_GT(compile_apart(walker_).size(), 0U);
  EXPECT_TRUE(has(refusal("<mujoco><size nuser_body='2147483647'/></mujoco>"), " "));
  std::signal(SIGCHLD, before);
}

}  // namespace
}  // namespace walker::mujoco
