# shellcheck shell=bash
# The distribution's packages by system: for building and running; for ./scripts/test, its lints and
# --all; and for rviz. Sourced by setup.sh.
# shellcheck disable=SC2034  # used by setup.sh

common_packages=(build-essential ca-certificates cmake libcairo2-dev libegl-dev libeigen3-dev libosmesa6-dev
  libtinyxml2-dev ninja-build pybind11-dev python3-dev python3-numpy python3-pip python3-setuptools
  python3-venv python3-wheel)
# A virtual screen, and tools that locate the windows on it and click into them.
screen_packages=(x11-utils xdotool xvfb)
common_test_packages=(git libegl-mesa0 libgl1-mesa-dri libgtest-dev locales pkg-config python3-pytest)
lint_packages=(catkin-lint cppcheck shellcheck)
# Emulates other processors.
emulator_packages=(qemu-user)
# Wheels for several Pythons differ in the bindings only.
cache_packages=(ccache)
# For ./scripts/dev/fuzz: the release's default clang. Since Debian 12 the sanitizers' libraries are
# a separate package.
fuzz_packages=(clang)
# All packages that ./scripts/docs needs: it builds nothing.
docs_packages=(ca-certificates doxygen python3-pip python3-venv)

message_packages=(diagnostic geometry nav sensor std visualization)

# packages_of_debian VERSION: 11, 12 or 13, which include ROS 1.
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
  view_packages=(librviz-dev rviz)
  # Without libopenblas0 torch multiplies matrices with the slow reference BLAS.
  example_packages=(chromium debootstrap libopenblas0 python3-torch)
  # A Node.js from another source includes npm and conflicts with Debian's npm.
  client_packages=()
  if [ ! -x /usr/bin/npm ]; then client_packages=(nodejs npm); fi
}

# Not tested on Ubuntu 20.04.
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
  example_packages=() # Ubuntu 20.04 has no PyTorch package
  client_packages=()
}
