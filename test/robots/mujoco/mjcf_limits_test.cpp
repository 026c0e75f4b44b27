// Models at which MuJoCo's compiler would crash, exhaust the memory, work for hours or block.
#include "robots/mujoco/mjcf_limits.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include "error_message.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"

namespace walker::mujoco {
namespace {

namespace fs = std::filesystem;

class MjcfLimitsTest : public testing::Test {
 protected:
  /// Returns the error message after the file's name, or "nothing thrown".
  std::string refusal(const std::string& content) const {
    const std::string file = folder_.write("model.xml", "<mujoco>" + content + "</mujoco>");
    const std::string message = message_of<std::invalid_argument>([&] { load_model(file); });
    const std::string begin = "parameter xml_file = " + file + ": ";
    return message.rfind(begin, 0) == 0 ? message.substr(begin.size()) : message;
  }

  void write_file(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_.path(name), std::ios::binary) << bytes;
  }

  Folder folder_;
};

std::string repeated(const std::string& text, std::size_t count) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += text;
  return all;
}

std::string bytes_of(std::initializer_list<std::int32_t> numbers) {
  std::string bytes;
  for (const std::int32_t number : numbers) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
  }
  return bytes;
}

std::string mesh_of(const std::string& file) {
  return "<asset><mesh name='m' file='" + file +
         "'/></asset><worldbody><geom type='mesh' mesh='m'/></worldbody>";
}

std::string height_field_of(const std::string& attributes) {
  return "<asset><hfield name='h' size='1 1 1 1' " + attributes + "/></asset>";
}

std::string texture_of(const std::string& attributes) {
  return "<asset><texture name='t' builtin='flat' " + attributes + "/></asset>";
}

TEST_F(MjcfLimitsTest, RejectsNumbersOutOfRange) {
  const struct {
    std::string content;
    const char* message;
  } cases[] = {
      {"<size nuser_body='2147483647'/>", "size nuser_body = 2147483647: must be between -1 and"},
      {"<size nuser_jnt='1001'/>", "size nuser_jnt = 1001: must be between -1 and 1000"},
      {"<size nuser_geom='1001'/>", "size nuser_geom = 1001"},
      {"<size nstack = \"250000001\" />", "size nstack = 250000001"},
      {"<size njmax='10001' nconmax='100'/>", "size njmax = 10001"},
      {"<size nconmax='100001'/>", "size nconmax = 100001"},
      {"<size nkey='10001'/>", "size nkey = 10001"},
      {"<size nuserdata='-1'/>", "size nuserdata = -1"},
      {"<size nkey='&#57;9999999'/>", "size nkey = &#57;9999999"},
      {"<size nkey='ten'/>", "size nkey = ten"},
      {"<!-- <a b=' --><size nkey='10001'/>", "size nkey = 10001"},
      {"<![CDATA[<a b=']]><size nkey='10001'/>", "size nkey = 10001"},
      {"<?a <b c=' ?><size nkey='10001'/>", "size nkey = 10001"},
      {"<size nkey='9e9'/>", "size nkey = 9e9"},
      {"<sensor><user dim='2147483647'/></sensor>", "user dim = 2147483647"},
      {height_field_of("nrow='100000' ncol='100000'"), "hfield ncol = 100000"},
      {height_field_of("nrow='-5' ncol='-5'"), "hfield ncol = -5"},
      {height_field_of("nrow='20000' ncol='20000'"), "must have at most 200000000 pixels"},
      {texture_of("type='2d' width='60000' height='60000'"), "texture height = 60000"},
      {texture_of("type='2d' width='20000' height='20000'"), "must have at most 200000000 pixels"},
      {texture_of("type='cube' width='6000'"), "must have at most 200000000 pixels"},
      {"<option iterations='2147483647' tolerance='0'/>",
       "option iterations = 2147483647: must be between 0 and 10000"},
      {"<option noslip_iterations='10001'/>", "option noslip_iterations = 10001"},
      {"<option mpr_iterations='10001'/>", "option mpr_iterations = 10001"},
      {"<visual><global offwidth='2147483647'/></visual>", "global offwidth = 2147483647"},
      {"<visual><global offheight='0'/></visual>", "global offheight = 0: must be between 1 and"},
      {"<visual><quality shadowsize='2147483647'/></visual>", "quality shadowsize = 2147483647"},
      {"<visual><quality offsamples='-1'/></visual>", "quality offsamples = -1"},
      {"<visual><quality numslices='100000'/></visual>", "quality numslices = 100000"},
      {"<visual><quality numstacks='0'/></visual>", "quality numstacks = 0"},
      {"<visual><quality numquads='1001'/></visual>", "quality numquads = 1001"},
      {"<worldbody><composite count='100000 100000 1'/></worldbody>",
       "must not have an element composite"},
      {"<compiler><lengthrange inttotal='1e9'/></compiler>",
       "must not have an element lengthrange"},
  };
  for (const auto& each : cases) {
    EXPECT_EQ(refusal(each.content).rfind(each.message, 0), 0U)
        << each.content << ": " << refusal(each.content);
  }
}

TEST_F(MjcfLimitsTest, CompilesTheLargestNumbers) {
  for (const std::string& content :
       {std::string("<size nstack='250000000'/>"), std::string("<size nconmax='100000'/>"),
        std::string("<size nkey='10000' nuserdata='1000000'/>"),
        "<size nuser_geom='1000'/><worldbody>" + repeated("<geom size='1'/>", 1000) +
            "</worldbody>"}) {
    EXPECT_EQ(refusal(content), "nothing thrown") << content;
  }
}

/// MuJoCo itself rejects these.
TEST_F(MjcfLimitsTest, MuJoCoRejectsAssetsWithWrongSizes) {
  write_file("hills.bin", bytes_of({100000, 100000, 0}));
  write_file("negative.bin", bytes_of({-5, -5, 0}));
  write_file("mesh.stl", std::string(80, ' ') + bytes_of({2147483647}));
  write_file("mesh.msh", bytes_of({2147483647, 2147483647, 2147483647, 2147483647}));
  write_file(
      "picture.png",
      std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\2\0\0\0", 29) +
          std::string(100, 'x'));
  EXPECT_NE(refusal(height_field_of("file='hills.bin'")).find("hills.bin"), std::string::npos);
  EXPECT_NE(refusal(height_field_of("file='negative.bin'")).find("negative"), std::string::npos);
  EXPECT_NE(refusal(mesh_of("mesh.stl")).find("mesh.stl"), std::string::npos);
  EXPECT_NE(refusal(mesh_of("mesh.msh")).find("mesh.msh"), std::string::npos);
  EXPECT_NE(refusal("<asset><texture name='t' type='2d' file='picture.png'/></asset>").find("PNG"),
            std::string::npos);
}

TEST_F(MjcfLimitsTest, MuJoCoRejectsDeepNestingAndRecursion) {
  const std::string deep = repeated("<body>", 9000) + repeated("</body>", 9000);
  EXPECT_NE(refusal("<worldbody>" + deep + "</worldbody>").find("nesting"), std::string::npos);
  EXPECT_NE(refusal("<include file='model.xml'/>").find("already included"), std::string::npos);
}

TEST_F(MjcfLimitsTest, RejectsIrregularFiles) {
  fs::create_directory(folder_.path("meshes"));
  for (const char* name : {"pipe.stl", "meshes/pipe.obj"}) {
    ASSERT_EQ(mkfifo(folder_.path(name).c_str(), S_IRUSR | S_IWUSR), 0);
  }
  fs::create_symlink("/dev/zero", folder_.path("zeros.stl"));
  const std::string pipe = "pipe.stl: must be a regular file";
  EXPECT_EQ(refusal("<include file='pipe.stl'/>"), pipe);
  EXPECT_EQ(refusal(mesh_of("pipe.stl")), pipe);
  EXPECT_EQ(refusal(height_field_of("file='pipe.stl'")), pipe);
  EXPECT_EQ(refusal("<asset><texture name='t' type='cube' fileup='pipe.stl'/></asset>"), pipe);
  EXPECT_EQ(refusal("<compiler meshdir='meshes'/>" + mesh_of("pipe.obj")),
            "pipe.obj: must be a regular file");
  EXPECT_EQ(refusal("<include file='zeros.stl'/>"), "zeros.stl: must be a regular file");
  for (const std::string& file : {folder_.path("pipe.stl"), std::string("/dev/zero")}) {
    EXPECT_EQ(message_of<std::invalid_argument>([&] { load_model(file); }),
              "parameter xml_file = " + file + ": " + fs::path(file).filename().string() +
                  ": must be a regular file");
  }
}

TEST_F(MjcfLimitsTest, RejectsLargeFiles) {  // sparse ones
  const std::uintmax_t max = std::uintmax_t{64} << 20U;
  const std::string file = folder_.write("large.xml", "");
  fs::resize_file(file, max + 1);
  EXPECT_EQ(message_of<std::runtime_error>([&] { check_mjcf(file); }),
            "has 67108865 bytes, included files counted; must have at most 67108864");
  EXPECT_EQ(refusal(mesh_of("large.xml")), "large.xml: must have at most 67108864 bytes");
  fs::resize_file(file, max);
  EXPECT_EQ(message_of<std::runtime_error>([&] { check_mjcf(file); }), "nothing thrown");
  EXPECT_EQ(refusal("<include file='large.xml'/>"),
            "has 67108908 bytes, included files counted; must have at most 67108864");
}

TEST_F(MjcfLimitsTest, RejectsManyElements) {
  constexpr std::size_t kMax = 20000;
  const auto geoms = [](std::size_t count) {
    return "<worldbody>" + repeated("<geom size='1'/>", count) + "</worldbody>";
  };
  const std::string message = "must have at most 20000 elements, included files counted";
  const std::string accepted = "nothing thrown";
  EXPECT_EQ(refusal(geoms(kMax - 1)), message);
  EXPECT_EQ(refusal(geoms(kMax - 2) + "<!-- " + geoms(9) + "-->"), accepted);
  // <mujoco>, <worldbody>, <include> and <mujocoinclude> count as elements.
  write_file("geoms.xml", "<mujocoinclude>" + geoms(kMax - 4) + "</mujocoinclude>");
  EXPECT_EQ(refusal("<include file='geoms.xml'/>"), accepted);
  EXPECT_EQ(refusal("<include\n file = \"geoms.xml\" /><option/>"), message);
}

TEST_F(MjcfLimitsTest, RejectsAZeroByteInThePath) {
  const std::string file = folder_.write("model.xml", builtin_text("walker2d_v5.xml"));
  const std::string message =
      message_of<std::invalid_argument>([&] { load_model(file + std::string("\0junk", 5)); });
  EXPECT_NE(message.find("model.xml\\x00junk: must not have a zero byte"), std::string::npos)
      << message;
}

}  // namespace
}  // namespace walker::mujoco
