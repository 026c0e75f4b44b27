# shellcheck shell=bash
# The set-up that the commands share: system, packages, engines, virtual environment, build.
# Source it, then call set_up. Every step looks first whether it is done; an interrupted one is done
# again by the next command. What the tools say goes to build/log/, what this says to stderr: a line
# for each step that has something to do.
#
# The build is in build/.ros, hidden from roslaunch, which walks through a package's visible folders; its
# devel space is in devel/, for rosrun does not look into a package's build/.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
build=$root/build
logs=$build/log
venv=$build/venv
jobs=$(nproc)
ros_setup=/dev/null # what the distribution's ROS itself needs sourced
release_alone=''    # where packages are taken from if they cannot be had with its updates
# shellcheck source=scripts/packages.sh
source "$root/scripts/packages.sh"

# The ROS build. BOX2D_SOURCE_DIR and MUJOCO_DIR, if set, name copies of the pinned engines.
ros_build=$build/.ros
devel=$root/devel
common_options=(-DPYTHON_EXECUTABLE=/usr/bin/python3 -DPython3_EXECUTABLE=/usr/bin/python3)
ros_options=("${common_options[@]}" "-DCATKIN_DEVEL_PREFIX=$devel"
  "-DBOX2D_SOURCE_DIR=${BOX2D_SOURCE_DIR:-}" "-DMUJOCO_DIR=${MUJOCO_DIR:-}")
# What a command wants on top, set by it before set_up.
extra_packages=()
extra_options=()
wants_venv=yes
build_targets=(all)
# Languages in which nobody here talks to the messages.
export ROS_LANG_DISABLE=geneus:genlisp:gennodejs

say() { printf '%s\n' "$*" >&2; }

die() {
  say "${0##*/}: $*"
  exit 1
}

# quiet NAME CMD...: CMD with its output in build/log/NAME.log; the log's end is shown on failure.
quiet() {
  local log=$logs/$1.log status=0
  shift
  "$@" >"$log" 2>&1 </dev/null || status=$?
  if [ "$status" -ne 0 ]; then
    tail -n 40 "$log" | sed 's/^/  | /' >&2
    say "${0##*/}: failed with status $status; all of it is in $log"
  fi
  return "$status"
}

# within SETUP CMD...: CMD where only the space with the file SETUP is sourced, out of sight of
# pyenv, conda and other workspaces. SETUP is /dev/null where there is nothing to source.
within() {
  # shellcheck disable=SC2016  # for the inner shell
  env -u PYTHONHOME -u PYTHONPATH -u CMAKE_PREFIX_PATH -u ROS_PACKAGE_PATH -u LD_LIBRARY_PATH \
    -u PKG_CONFIG_PATH -u VIRTUAL_ENV -u ROS_NAMESPACE -u ROS_IP -u ROS_LOG_DIR PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    bash -c 'command=("$@"); set --; source "$0"; exec "${command[@]}"' "$@"
}

# find_files EXPRESSION...: our files, without what was built.
find_files() {
  find "$root" \( -path "$build" -o -path "$devel" -o -path "$root/.git" \) -prune -o -type f "$@" -print
}

check_system() {
  local id version machine
  # shellcheck source=/dev/null
  id=$(source /etc/os-release && echo "$ID") version=$(source /etc/os-release && echo "${VERSION_ID:-}")
  machine=$(uname -m)
  case $machine in
    x86_64 | aarch64) ;;
    *) die "this machine is $machine; must be x86_64 or aarch64" ;;
  esac
  case $id-$version in
    debian-11 | debian-12 | debian-13)
      ros_setup=/dev/null
      packages_of_debian "$version"
      if [ "$version" = 11 ]; then release_alone=bullseye; fi
      ;;
    ubuntu-20.04)
      ros_setup=/opt/ros/noetic/setup.bash
      packages_of_ubuntu_20_04
      [ -e "$ros_setup" ] || die "Ubuntu 20.04 without $ros_setup: add the ROS Noetic package" \
        "source and install ros-noetic-ros-core first"
      ;;
    *) die "this system is $id${version:+ $version}; must be Debian 11, 12 or 13, or Ubuntu 20.04 with" \
      "ROS Noetic" ;;
  esac
  case $root in
    *[[:space:]\;\"\'\$\\]*) die "the path $root has a blank or one of ; \" ' \$ \\ in it," \
      "which catkin cannot work in: move this folder" ;;
  esac
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

# Those of the packages $@ that are not installed whole, one a line.
missing_packages() {
  comm -23 <(printf '%s\n' "$@" | sort -u) \
    <(dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' "$@" 2>/dev/null |
      awk 'substr($1, 2) == "i" { print $2 }' | sort -u)
}

apt_install() {
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y --no-install-recommends \
    -o Acquire::Retries=3 -o DPkg::Lock::Timeout=300 install "$@"
}

# Debian 11's security archive lists packages that it holds no longer: then the release's own.
install_packages() {
  as_root dpkg --configure -a && as_root apt-get -q -o Acquire::Retries=3 update || return
  apt_install "$@" || { [ -n "$release_alone" ] && apt_install -t "$release_alone" "$@"; }
}

set_up_packages() {
  local wanted=("${base_packages[@]}" "${extra_packages[@]}") missing
  mapfile -t missing < <(missing_packages "${wanted[@]}")
  if [ ${#missing[@]} -eq 0 ]; then return; fi
  if [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null; then
    die "not root and no sudo, so these packages cannot be installed: ${missing[*]}"
  fi
  say "packages: installing ${#missing[@]} of ${#wanted[@]} and what they need"
  quiet packages install_packages "${missing[@]}" 8>&- 9>&- # no daemon shall inherit a lock
}

# make_venv DIR REQUIREMENTS PYTHON OPTION...
make_venv() {
  rm -rf "$1" && env -u PYTHONHOME -u PYTHONPATH "$3" -m venv "${@:4}" "$1" &&
    env -u PYTHONHOME -u PYTHONPATH -u PIP_REQUIRE_VIRTUALENV \
      "$1/bin/python" -m pip install --disable-pip-version-check --progress-bar off \
      --require-hashes -r "$2"
}

# set_up_venv WHAT DIR REQUIREMENTS [PYTHON]: unless that is done already, with the hashes in the .lock
# beside the requirements. Of the distribution's Python with the system's packages: ROS's are among them,
# and its command line tools are run by the first python3 in sight. Of another PYTHON without any.
set_up_venv() {
  local what=$1 dir=$2 requirements=${3%.txt}.lock python=(/usr/bin/python3 --system-site-packages) wanted
  if [ $# -gt 3 ]; then python=("$4"); fi
  wanted=$({ echo "$dir" "${python[@]:1}" && "${python[0]}" --version && cat "$requirements"; } |
    sha256sum)
  if [ "$(cat "$dir/ready" 2>/dev/null)" = "$wanted" ]; then return; fi
  say "$what: installing ${requirements#"$root/"} to ${dir#"$root/"}"
  quiet "${dir##*/}" make_venv "$dir" "$requirements" "${python[@]}" || return
  echo "$wanted" >"$dir/ready.new" && mv "$dir/ready.new" "$dir/ready"
}

# Of the examples and of the benchmark's learner: example_venv LEARNER.
example_venv() { echo "$build/.examples/$1"; }

# With the distribution's PyTorch, for pip's brings gigabytes for GPUs; pip does not see it, so the
# requirements are complete and pip has to look for no more.
set_up_example() {
  PIP_NO_DEPS=1 set_up_venv "examples $1" "$(example_venv "$1")" \
    "$root/test/examples/requirements_$1.txt"
}

# fetch_engine NAME VARIABLE: the pinned engine, unless the variable names a copy at hand. The fetching
# speaks if it has to fetch.
fetch_engine() { [ -n "${!2:-}" ] || "$root/scripts/fetch_engines" "$1" >/dev/null; }

set_up_engines() {
  fetch_engine box2d BOX2D_SOURCE_DIR && fetch_engine mujoco MUJOCO_DIR
}

# configure DIR OPTION...: with Ninja, unless it was done with these options (or more) before. Ninja
# itself sees changed files.
configure() {
  local dir=$1 stamp=$1/configured_with option copies ready=yes
  shift
  if [ ! -e "$stamp" ]; then
    ready=no
    rm -f "$dir/CMakeCache.txt" # never done, or interrupted
  elif ! grep -qxF "source $root" "$stamp"; then
    ready=no
    rm -rf "$dir" # the folder has moved: nothing of it can be used
  else
    for option in "$@"; do grep -qxF -e "$option" "$stamp" || ready=no; done
  fi
  [ $ready = no ] || return 0
  copies=$(printf '%s\n' "$@" | sed -n 's/^-D\(BOX2D_SOURCE_DIR\|MUJOCO_DIR\)=\(.\)/, \1=\2/p' | tr -d '\n')
  say "configure: ${dir#"$root/"}$copies"
  rm -f "$stamp"
  # Without these folders catkin would cache an environment in which Python finds no messages, and
  # pkg-config no package.
  mkdir -p "$devel/lib/python3/dist-packages" "$devel/lib/pkgconfig"
  quiet "configure_${dir##*[/.]}" within "$ros_setup" cmake -G Ninja -S "$root" -B "$dir" "$@" || return
  printf '%s\n' "source $root" "$@" >"$stamp.new" && mv "$stamp.new" "$stamp"
}

# build_in DIR TARGET...
build_in() {
  local dir=$1
  shift
  quiet "build_${dir##*[/.]}" announced "build: ${dir#"$root/"}" \
    within "$ros_setup" ninja -C "$dir" -j "$jobs" "$@" 3>&2
}

# announced TEXT NINJA...: says TEXT on descriptor 3 once Ninja makes something. It looks for new files each
# time, and catkin for the packages of messages.
announced() {
  "${@:2}" | TEXT=$1 awk '/^\[[0-9]+\/[0-9]+\] / && !/Re-checking globbed|genmsg_check_deps/ && !said++ {
      print ENVIRON["TEXT"] | "cat >&3"; close("cat >&3") }
    { print; fflush() }'
}

# A cache of compilations where there is one. It knows a file by its way from the build directory, so
# build directories that are as far below their sources share what is compiled. It tells locales apart
# too: where there is none, Python sets one for what it starts, catkin_make's compiler for example.
use_compiler_cache() {
  if command -v ccache >/dev/null; then
    export CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_SLOPPINESS=pch_defines,time_macros \
      CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1
    [ -n "${LC_ALL:-}${LC_CTYPE:-}${LANG:-}" ] || export LC_CTYPE=C.UTF-8
  fi
}

set_up_build() {
  use_compiler_cache
  configure "$ros_build" "${ros_options[@]}" "${extra_options[@]}" || return
  build_in "$ros_build" "${build_targets[@]}"
}

# set_up_instrumented KIND TARGET...: what test/instrument.cmake can do, in a build and a devel space of its
# own, build/.KIND.
set_up_instrumented() {
  local kind=$1 dir=$build/.$1 warnings_are_errors=ON
  shift
  if [ "$kind" = fuzzer ]; then warnings_are_errors=OFF; fi # clang's are others than GCC's
  set_up_packages && set_up_engines || return
  # gcov's counters go by the paths that the cache shortens.
  if [ "$kind" != coverage ]; then use_compiler_cache; fi
  mkdir -p "$dir/devel/lib/python3/dist-packages" "$dir/devel/lib/pkgconfig"
  configure "$dir" "${common_options[@]}" "-DWALKER_SIM_INSTRUMENT=$kind" \
    -DWALKER_SIM_WERROR=$warnings_are_errors -DWALKER_SIM_TESTS=ON "-DCATKIN_DEVEL_PREFIX=$dir/devel" \
    "-DBOX2D_SOURCE_DIR=${BOX2D_SOURCE_DIR:-}" "-DMUJOCO_DIR=${MUJOCO_DIR:-}" "${extra_options[@]}" || return
  build_in "$dir" "$@"
}

# locked CMD...: one at a time in this folder. A subshell, so that nothing started later inherits
# the lock.
locked() (
  if ! flock -n 9; then
    say "waiting for another command that is setting up here"
    flock 9
  fi
  "$@"
) 9>"$build/lock"

# The virtual environment while the compiler works, for that one waits for the network.
set_up_all() {
  local status=0 venv_job=''
  set_up_packages || return
  if [ $wants_venv = yes ]; then
    set_up_venv "virtual environment" "$venv" "$root/scripts/requirements.txt" &
    venv_job=$!
  fi
  set_up_engines && set_up_build || status=$?
  if [ -n "$venv_job" ]; then wait "$venv_job" || status=$?; fi
  return "$status"
}

# Everything; its failure is the caller's end or not, as the caller says.
set_up() {
  check_system
  mkdir -p "$logs"
  locked set_up_all || return
  use_compiler_cache # again: what is locked is a shell of its own
}

# The ready environment, for this shell and what it starts.
activate() {
  local -
  set +eu
  unset PYTHONHOME
  # shellcheck source=/dev/null
  source "$devel/setup.bash"
  if [ $wants_venv = yes ]; then export PATH=$venv/bin:$PATH VIRTUAL_ENV=$venv; fi
  if [ -z "${ROS_HOSTNAME:-}${ROS_IP:-}" ]; then export ROS_HOSTNAME=localhost; fi
}
