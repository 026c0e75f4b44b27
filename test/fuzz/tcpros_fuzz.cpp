// Connection headers, as client and server read them.
#include "wire/tcpros.h"

#include <stdexcept>

#include "fuzz/target.h"

namespace walker::fuzz {
namespace {

void run(const std::uint8_t* data, std::size_t size) {
  tcpros::Fields fields;
  try {
    fields = tcpros::parse_header(data, size);
  } catch (const std::runtime_error&) {
    return;
  }
  tcpros::Bytes again;
  tcpros::append_header(fields, again);
  require(again.size() == tcpros::kLengthBytes + size, "a header written again has its length");
  require(tcpros::load_length(again.data()) == size, "its length is told");
  require(tcpros::parse_header(again.data() + tcpros::kLengthBytes, size) == fields,
          "it reads as the same");
}

const Registered kTarget("tcpros", run);

}  // namespace
}  // namespace walker::fuzz
