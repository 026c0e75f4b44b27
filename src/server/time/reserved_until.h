// The parameter with the end of the simulation time that servers of one master have reserved.
#pragma once

#include <cstdint>
#include <string>

#include "wire/xml_rpc.h"

namespace walker {

/// Outside any node's namespace, which launch files may clear.
constexpr const char* kReservedUntil = "/walker_sim_clock/reserved_until";  // [s, ns]

/// @param value the parameter's value on the master, which any program may have set
/// @return the time [ns]
/// @throws std::invalid_argument naming the parameter, its value and what is allowed
std::uint64_t read_reserved_until(const xml_rpc::Value& value);

/// @param time below 2^32 s [ns]
/// @return the value of the parameter, as XML-RPC
std::string to_reserved_until(std::uint64_t time);

}  // namespace walker
