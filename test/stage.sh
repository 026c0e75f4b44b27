#!/usr/bin/env bash
# The commands of stages.cmake, which are listed at the end.
# They work in hidden folders of build/, because roslaunch searches a package's visible folders.
set -euo pipefail
# shellcheck source=scripts/setup.sh
source "$(dirname "${BASH_SOURCE[0]}")/../scripts/setup.sh"
# shellcheck source=scripts/debian_root.sh
source "$root/scripts/debian_root.sh"

workspace=$build/.workspace

# Copies the tree, because a link into it would be a cycle. Builds inside the copy, as build/.ros is
# inside the tree, so that both share the compiler cache. Copies the test programs beside the installed
# ones, where rostest looks for them; they find the installed library by the same path.
make_workspace() {
  local package=$workspace/src/walker_sim file
  rm -rf "$workspace" && mkdir -p "$package" && cd "$root" &&
    tar -c --exclude=./build --exclude=./devel --exclude=./.git . | tar -x -C "$package"
  cp -r "$package/examples/my_walker_pkg" "$workspace/src/" # beside the package, as a user does
  cd "$workspace"
  within "$ros_setup" catkin_make --build "$package/build" -j"$jobs" -l"$((jobs * 2))" install \
    "${ros_options[@]}" -DCATKIN_DEVEL_PREFIX="$package/devel" -DWALKER_SIM_WERROR=ON
  if find "$package/build" -path '*.dir/test/*.o' | grep .; then
    die "catkin_make has compiled tests: nobody has asked for them"
  fi
  [ -x install/lib/my_walker_pkg/episode ] || die "catkin_make has not built my_walker_pkg"
  rm -rf "$package" install/lib/my_walker_pkg install/share/my_walker_pkg # must not be needed
  for file in "$devel/lib/walker_sim/"*; do
    [ -e "install/lib/walker_sim/${file##*/}" ] || cp -P "$file" install/lib/walker_sim/
  done
}

clean=(env -i "HOME=$HOME" PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 PYTHONDONTWRITEBYTECODE=1)

# in_space SETUP_FILE COMMAND...: runs the command in a clean environment after sourcing SETUP_FILE.
in_space() {
  # shellcheck disable=SC2016  # for the inner shell
  "${clean[@]}" ROS_HOSTNAME=localhost ROS_HOME="$ros_home" \
    WALKER_SIM_PROGRAMS="$devel/lib/walker_sim" bash -c 'source "$0" && exec "$@"' "$@"
}

# over_ros ROS_HOME COMMAND...: runs the command with the devel space and the programs for ROS tests.
over_ros() {
  within "$devel/setup.bash" env ROS_HOSTNAME=localhost PYTHONDONTWRITEBYTECODE=1 ROS_HOME="$1" \
    WALKER_SIM_PROGRAMS="$devel/lib/walker_sim" "${@:2}"
}

pytest=(-m pytest -q -p no:cacheprovider)

# Each run has its own ROS_HOME, so that runs in parallel do not share rostest's result files. rostest's
# --text would report no failure.
run_installed() {
  local kind=$1 last=${*: -1} command
  if [ "$kind" = rostest ]; then
    command=(rostest --pkgdir="$root" --package=walker_sim "${@:2}")
  else
    command=("$venv/bin/python" "${pytest[@]}" --noconftest "$2")
  fi
  ros_home=$build/.install_ros_home/$(basename "${last%.*}")
  in_space "$workspace/install/setup.bash" "${command[@]}"
}

# Tests a user's workspace on top of walker_sim's install space: in its devel space, then in its install
# space without the build and devel folders.
run_my_walker_pkg() {
  local mine=$build/.my_workspace
  ros_home=$mine/ros_home
  rm -rf "$mine" && mkdir -p "$mine/src" && cp -r "$root/examples/my_walker_pkg" "$mine/src/"
  cd "$mine"
  in_space "$workspace/install/setup.bash" catkin_make
  in_space devel/setup.bash catkin_make run_tests
  in_space devel/setup.bash catkin_test_results build/test_results
  in_space devel/setup.bash catkin_make install
  cp src/my_walker_pkg/test/my_walker_test.py install/lib/my_walker_pkg/
  rm -rf build devel
  in_space install/setup.bash rostest --pkgdir="$mine/src/my_walker_pkg" --package=my_walker_pkg \
    --results-base-dir="$mine/results" src/my_walker_pkg/test/my_walker.test
  in_space install/setup.bash catkin_test_results "$mine/results"
}

version_of() { "$1" -I -c 'import sys; print("%d.%d" % sys.version_info[:2])'; }

# Builds build/.wheel/VERSION/*.whl as a user does, unless no file of the package has changed since.
build_wheel() {
  local version folder environment
  version=$(version_of "$1")
  folder=$build/.wheel/$version
  if [ -e "$folder/ready" ] && [ -z "$(find_files ! -name '*.pyc' -newer "$folder/ready")" ]; then
    return
  fi
  environment=$build/.wheel/${version}_pip # Debian 11's pip has no --config-settings and copies the tree
  set_up_venv "wheel $version" "$environment" "$root/test/python/wheel_pip.txt" "$1"
  mkdir -p "$folder" && rm -f "$folder/ready" "$folder"/*.whl && touch "$folder/ready.new"
  within /dev/null env CXX="${CXX:-/usr/bin/c++}" "$environment/bin/python" -m pip wheel \
    --disable-pip-version-check --no-deps --wheel-dir "$folder" \
    --config-settings=build-dir="$build/.wheel_$version" \
    --config-settings=cmake.define.WALKER_SIM_WERROR=ON "$root"
  mv "$folder/ready.new" "$folder/ready"
}

# Runs the wheel's suite without ROS. test/python/wheel_oldest.txt and wheel_newest.txt list the other
# packages in the environment.
run_wheel_suite() {
  local interpreter=$1 which=$2 version environment pip=()
  version=$(version_of "$interpreter")
  environment=$build/.wheel/${version}_$which
  set_up_venv "wheel $version $which" "$environment" "$root/test/python/wheel_$which.txt" "$interpreter"
  pip=("$environment/bin/python" -m pip --disable-pip-version-check)
  within /dev/null "${pip[@]}" install --no-index --no-deps --force-reinstall "$build/.wheel/$version"/*.whl
  within /dev/null "${pip[@]}" check
  exec "${clean[@]}" ROS_HOME="$build/.wheel/ros_home" WALKER_SIM_DEVEL="$devel" \
    "$environment/bin/python" "${pytest[@]}" --noconftest "$root/test/python/wheel_test.py"
}

# Installs the wheel with its extras in a new environment, as a user does, without compiling anything.
run_wheel_readme() {
  local interpreter=$1 environment wheel
  environment=$build/.wheel/$(version_of "$interpreter")_readme
  rm -rf "$environment" && within /dev/null "$interpreter" -m venv "$environment"
  wheel=$(echo "$build/.wheel/$(version_of "$interpreter")"/*.whl)
  within /dev/null "$environment/bin/python" -m pip install --disable-pip-version-check -q \
    --only-binary=:all: "${wheel}[box2d,web]" pytest
  exec "${clean[@]}" "$environment/bin/python" "${pytest[@]}" --noconftest \
    "$root/test/python/readme_wheel_test.py"
}

run_example() {
  over_ros "$build/.examples/ros_home" "$(example_venv "$1")/bin/python" "${pytest[@]}" "$2"
}

run_page() {
  over_ros "$build/.page/ros_home" "$page_venv/bin/python" "${pytest[@]}" "$1"
}

# Fetches the source package of the installed release, verified by the hashes of the same lock file.
fetch_sb3_sources() {
  local folder=$1 requirement
  requirement=$(sed -n '/^stable-baselines3==/,/[^\\]$/p' "$root/test/examples/requirements_sb3.lock")
  if [ "$(cat "$folder/ready" 2>/dev/null)" != "$requirement" ]; then
    rm -rf "$folder" && mkdir -p "$folder" && echo "$requirement" >"$folder/requirements.txt"
    within /dev/null env -u PIP_REQUIRE_VIRTUALENV /usr/bin/python3 -m pip download --disable-pip-version-check \
      --require-hashes --no-deps --no-binary=:all: --no-build-isolation --dest "$folder" \
      --requirement "$folder/requirements.txt"
    tar -x --strip-components=1 -C "$folder" -f "$folder"/stable?baselines3-*.tar.gz
    mv "$folder/requirements.txt" "$folder/ready"
  fi
}

run_sb3_suite() {
  local sources=$build/.examples/sb3_sources
  fetch_sb3_sources "$sources"
  within "$devel/setup.bash" env PYTHONDONTWRITEBYTECODE=1 "$(example_venv sb3)/bin/python" \
    "$root/test/python/suites.py" sb3 "$sources"
}

rosnodejs=$build/.rosnodejs

# Installs the modules, verified by the hashes of package-lock.json, unless they are up to date. Runs no
# package scripts.
set_up_rosnodejs() {
  local sources=$root/test/python/rosnodejs
  mkdir -p "$rosnodejs" && cp "$sources/"* "$rosnodejs"
  if ! cmp -s "$sources/package-lock.json" "$rosnodejs/ready"; then
    rm -f "$rosnodejs/ready"
    within /dev/null npm ci --prefix "$rosnodejs" --cache "$rosnodejs/cache" --ignore-scripts --no-audit --no-fund
    cp "$sources/package-lock.json" "$rosnodejs/ready"
  fi
}

run_rosnodejs() {
  WALKER_SIM_ROSNODEJS=$rosnodejs over_ros "$rosnodejs/ros_home" "$venv/bin/python" "${pytest[@]}" "$1"
}

# TorchRL needs a newer PyTorch than Debian 12 has, and pip's includes gigabytes for GPUs. Therefore
# debootstrap installs Debian 13's PyTorch in a folder. PYTHON's pip adds the pinned requirements and, at
# every run, the wheel; PYTHON has the version of Debian 13's Python.
torchrl_root=$(example_venv torchrl)
torchrl_packages=python3-numpy,python3-torch,libopenblas0
torchrl_requirements=$root/test/examples/requirements_torchrl.lock

make_torchrl_root() {
  as_root rm -rf "$torchrl_root" &&
    as_root debootstrap --variant=minbase --include="$torchrl_packages" trixie "$torchrl_root" "$(debian_mirror)" &&
    as_root find "$torchrl_root/var/cache/apt/archives" -name '*.deb' -delete &&
    install_in_torchrl_root "$1" --require-hashes --requirement "$torchrl_requirements"
}

install_in_torchrl_root() {
  as_root env -u PYTHONHOME -u PYTHONPATH -u PIP_REQUIRE_VIRTUALENV PIP_ROOT_USER_ACTION=ignore \
    "$1" -m pip install --disable-pip-version-check --progress-bar off --no-deps --only-binary=:all: \
    --upgrade --target "$torchrl_root/opt/packages" "${@:2}"
}

set_up_torchrl_root() {
  local interpreter=$1 version ready=$torchrl_root.ready wanted
  version=$(version_of "$interpreter")
  wanted=$({ echo "$torchrl_packages" && cat "$torchrl_requirements"; } | sha256sum)
  if [ "$(cat "$ready" 2>/dev/null)" != "$wanted" ]; then
    rm -f "$ready" && mkdir -p "${ready%/*}" && make_torchrl_root "$interpreter"
    echo "$wanted" >"$ready.new" && mv "$ready.new" "$ready"
  fi
  install_in_torchrl_root "$interpreter" --no-index "$build/.wheel/$version"/*.whl
}

run_torchrl_example() {
  local suite=$1 place=/opt/walker_sim
  as_root rm -rf "$torchrl_root$place" && as_root mkdir -p "$torchrl_root$place/test" &&
    as_root cp -r "$root/examples" "$torchrl_root$place" &&
    as_root cp -r "$root/test/examples" "$torchrl_root$place/test"
  as_root chroot "$torchrl_root" /usr/bin/env -i HOME=/root PATH=/usr/bin:/bin LANG=C.UTF-8 \
    PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=/opt/packages python3 "${pytest[@]}" "$place/${suite#"$root/"}"
}

check_system
case $1 in
  workspace) make_workspace ;;                  # builds and installs an ordinary workspace with catkin_make
  installed) run_installed "${@:2}" ;;          # rostest|pytest FILE [ARG]: runs it in the install space alone
  my_walker_pkg) run_my_walker_pkg ;;           # builds, tests and installs examples/my_walker_pkg on top of it
  wheel) build_wheel "$2" ;;                    # PYTHON: builds the wheel with pip
  wheel_suite) run_wheel_suite "${@:2}" ;;      # PYTHON oldest|newest: runs its suite in a clean environment
  wheel_readme) run_wheel_readme "$2" ;;        # PYTHON: runs README's examples without ROS with the wheel
  example_venv) set_up_example "$2" ;;          # LEARNER: makes the virtual environment of an example
  example) run_example "${@:2}" ;;              # LEARNER FILE: runs a suite in it
  page_venv) set_up_page ;;                     # makes the virtual environment of the page
  page) run_page "$2" ;;                        # FILE: runs a suite in it
  sb3_suite) run_sb3_suite ;;                   # runs Stable-Baselines3's tests with this package
  rosnodejs_modules) set_up_rosnodejs ;;        # installs the client's modules (test/python/rosnodejs) with npm
  rosnodejs) run_rosnodejs "$2" ;;              # FILE: runs a suite that uses the client
  torchrl_root) set_up_torchrl_root "$2" ;;     # PYTHON: makes a Debian 13 root for TorchRL's example
  torchrl) run_torchrl_example "$2" ;;          # FILE: runs a suite in it
  *) die "$1: unknown command" ;;
esac
