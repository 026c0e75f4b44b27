// The services that the client calls.
#pragma once

#include <array>
#include <cstddef>

#include "wire/tcpros.h"

namespace walker {

struct ServiceType {
  const char* name;  ///< relative to the server's
  const char* type;
  const char* md5sum;  ///< of the definition in srv/; service_types_test compares it with ROS's
};

enum ServiceIndex : std::size_t {
  kGetSpec,
  kReset,
  kStep,
  kResetBatch,
  kStepBatch,
  kRender,
  kStepMany,
  kSnapshot,
  kRestore
};

// Bounds get_spec's answer, which no specification can. Enough for 500000 observation values.
constexpr std::size_t kMaxSpecificationBytes = 1 << 24;

constexpr std::array<ServiceType, 9> kServiceTypes{{
    {"get_spec", "walker_sim/GetSpec", "10ba3145e1d3d0f8df3cab81a4131ed4"},
    {"reset", "walker_sim/Reset", "31d1b710b7a99285fa80989beaac03dc"},
    {"step", "walker_sim/Step", "966a6fb1bec39160c190f0f4547374a0"},
    {"reset_batch", "walker_sim/ResetBatch", "e24e89a8840d29c7cfbdf93f4f843026"},
    {"step_batch", "walker_sim/StepBatch", "a7b1821e24f157217a6d76a0c335603f"},
    {"render", "walker_sim/Render", "ddec8823bcc866f5390ff2c9bb477f29"},
    {"step_many", "walker_sim/StepMany", "0f84f7c61cb488b9aad4529423766e03"},
    {"snapshot", "walker_sim/Snapshot", "2da424fb660ee1b8d8190e653d30b45e"},
    {"restore", "walker_sim/Restore", "c6aed4159958bb4803d219a0481eb653"},
}};

}  // namespace walker
