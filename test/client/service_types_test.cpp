// The client's service types and MD5 sums equal those that ROS generates from the .srv files.
#include "client/messages.h"

#include <gtest/gtest.h>

#include <ros/service_traits.h>

#include "walker_sim/GetSpec.h"
#include "walker_sim/Render.h"
#include "walker_sim/Reset.h"
#include "walker_sim/ResetBatch.h"
#include "walker_sim/Restore.h"
#include "walker_sim/SetState.h"
#include "walker_sim/SetWorld.h"
#include "walker_sim/Snapshot.h"
#include "walker_sim/Step.h"
#include "walker_sim/StepBatch.h"
#include "walker_sim/StepMany.h"

namespace walker {
namespace {

template <typename Service>
void expect_generated(ServiceIndex index, const std::string& name) {
  EXPECT_EQ(kServiceTypes[index].name, name);
  EXPECT_EQ(std::string(kServiceTypes[index].type), ros::service_traits::datatype<Service>());
  EXPECT_EQ(std::string(kServiceTypes[index].md5sum), ros::service_traits::md5sum<Service>())
      << kServiceTypes[index].type;
}

TEST(ServiceTypes, AreTheGeneratedOnes) {
  expect_generated<walker_sim::GetSpec>(kGetSpec, "get_spec");
  expect_generated<walker_sim::Reset>(kReset, "reset");
  expect_generated<walker_sim::Step>(kStep, "step");
  expect_generated<walker_sim::ResetBatch>(kResetBatch, "reset_batch");
  expect_generated<walker_sim::StepBatch>(kStepBatch, "step_batch");
  expect_generated<walker_sim::Render>(kRender, "render");
  expect_generated<walker_sim::StepMany>(kStepMany, "step_many");
  expect_generated<walker_sim::Snapshot>(kSnapshot, "snapshot");
  expect_generated<walker_sim::Restore>(kRestore, "restore");
  expect_generated<walker_sim::SetWorld>(kSetWorld, "set_world");
  expect_generated<walker_sim::SetState>(kSetState, "set_state");
}

}  // namespace
}  // namespace walker
