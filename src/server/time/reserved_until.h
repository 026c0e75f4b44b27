// The parameter on which servers of one master keep how far simulation time is reserved.
#pragma once

#include <cstdint>
#include <string>

#include "wire/xml_rpc.h"

namespace walker {

/// Not below a node's own name: launch files clear what is there.
constexpr const char* kReservedUntil = "/walker_sim_clock/reserved_until";  // [s, ns]

/// @param value as a master has it, which anybody may have set
/// @return the time [ns]
/// @throws std::invalid_argument naming the parameter, its value and what is allowed
std::uint64_t read_reserved_until(const xml_rpc::Value& value);

/// @param time below 2^32 s [ns]
/// @return the value that the parameter should have, in XML
std::string to_reserved_until(std::uint64_t time);

}  // namespace walker
