# shellcheck shell=bash
# The distribution's packages, by system: what building and running needs; what ./scripts/test needs on
# top, its lints and the rest of --all; and what watching the walker in rviz needs. Read by setup.sh.
# shellcheck disable=SC2034  # used by setup.sh

common_packages=(build-essential ca-certificates cmake libcairo2-dev libegl-dev libeigen3-dev libosmesa6-dev
  libtinyxml2-dev ninja-build pybind11-dev python3-dev python3-numpy python3-pip python3-setuptools
  python3-venv python3-wheel)
# A screen without a monitor, and where the windows on it are.
screen_packages=(x11-utils xvfb)
common_test_packages=(git libegl-mesa0 libgl1-mesa-dri libgtest-dev locales pkg-config python3-pytest)
lint_packages=(catkin-lint cppcheck shellcheck)
# Processors that the machine is not.
emulator_packages=(qemu-user)
# Of the wheels for several Pythons, all but the bindings is compiled alike.
cache_packages=(ccache)
# Of ./scripts/dev/fuzz: the clang of Debian 12, in other releases the one that is the default there. From
# Debian 12 on the sanitizers' libraries are a package apart.
fuzz_packages=(clang)
# All that ./scripts/docs needs, which builds nothing.
docs_packages=(ca-certificates doxygen python3-pip python3-venv)

message_packages=(diagnostic geometry nav sensor std visualization)

# packages_of_debian VERSION: 11, 12 or 13, which carry ROS 1 themselves.
packages_of_debian() {
  local x
  base_packages=("${common_packages[@]}"
    catkin ros-cmake-modules ros-message-generation ros-message-runtime ros-core rosbash
    libroscpp-dev libroslib-dev librospack-dev rospack-tools python3-rospy python3-roslaunch
    libdiagnostic-updater-dev libmessage-filters-dev libimage-transport-dev librosbag-storage-dev
    python3-rosbag libstd-srvs-dev ros-std-srvs python3-std-srvs
    libros-rosgraph-msgs-dev ros-rosgraph-msgs python3-rosgraph-msgs
    libtf2-eigen-dev libtf2-msgs-dev python3-tf2-msgs)
  for x in "${message_packages[@]}"; do
    base_packages+=("lib$x-msgs-dev" "ros-$x-msgs" "python3-$x-msgs")
  done
  test_packages=("${common_test_packages[@]}" librostest-dev python3-rostest libtf2-ros-dev
    python3-tf2-ros liburdf-dev)
  if [ "$1" -gt 11 ]; then fuzz_packages+=(libclang-rt-dev); fi
  view_packages=(rviz)
  # Without libopenblas0 torch multiplies matrices by a slow reference.
  example_packages=(debootstrap libopenblas0 python3-torch)
  # A Node.js of another source brings its own npm, which Debian's conflicts with.
  client_packages=()
  if [ ! -x /usr/bin/npm ]; then client_packages=(nodejs npm); fi
}

# Untested: nobody has run this on Ubuntu 20.04 yet.
packages_of_ubuntu_20_04() {
  local x
  base_packages=("${common_packages[@]}" ros-noetic-catkin ros-noetic-ros-core)
  for x in diagnostic-updater image-transport message-filters message-generation message-runtime \
    rosbash rosbag rosbag-storage roscpp rosgraph-msgs roslaunch roslib rospy std-srvs tf2-eigen tf2-msgs; do
    base_packages+=("ros-noetic-$x")
  done
  for x in "${message_packages[@]}"; do base_packages+=("ros-noetic-$x-msgs"); done
  test_packages=("${common_test_packages[@]}" ros-noetic-rostest ros-noetic-tf2-ros ros-noetic-urdf)
  view_packages=(ros-noetic-rviz)
  example_packages=() # it has no PyTorch
  client_packages=()
}
