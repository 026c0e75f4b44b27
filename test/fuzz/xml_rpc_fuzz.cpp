// XML-RPC answers of a master.
#include "wire/xml_rpc.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "fuzz/target.h"

namespace walker::fuzz {
namespace {

std::size_t depth_of(const xml_rpc::Value& value) {
  std::size_t depth = 0;
  for (const xml_rpc::Value& element : value.elements) {
    depth = std::max(depth, 1 + depth_of(element));
  }
  return depth;
}

void run(const std::uint8_t* data, std::size_t size) {
  try {
    const xml_rpc::Value value = xml_rpc::parse_answer(std::string(data, data + size));
    require(depth_of(value) <= 17, "the depth of values is bounded");
  } catch (const std::runtime_error& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("xml_rpc", run);

}  // namespace
}  // namespace walker::fuzz
