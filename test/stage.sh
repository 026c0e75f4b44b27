#!/usr/bin/env bash
# What stages.cmake runs, one command each:
#   workspace                             an ordinary workspace, built and installed by catkin_make
#   installed rostest|pytest FILE XML     FILE where nothing but its install space is in sight
#   my_walker_pkg                         examples/my_walker_pkg on top of it, built, tested and installed
#   wheel PYTHON                          pip's wheel
#   wheel_suite PYTHON oldest|newest XML  the wheel's suite in a clean virtual environment
#   wheel_readme PYTHON XML               README's first example in one that the extra for it has filled
#   example_venv LEARNER                  the virtual environment of an example
#   example LEARNER FILE XML              a suite in it
#   sb3_suite XML                         tests of Stable-Baselines3's own, with an environment of ours
#   rosnodejs_modules                     what npm installs for the client in test/python/rosnodejs
#   rosnodejs FILE XML                    a suite beside it
#   torchrl_root PYTHON                   Debian 13 for the example with TorchRL, and its Python beside it
#   torchrl FILE XML                      a suite there
# What they make is in hidden folders of build/, for roslaunch walks through a package's visible ones.
set -euo pipefail
# shellcheck source=scripts/setup.sh
source "$(dirname "${BASH_SOURCE[0]}")/../scripts/setup.sh"
# shellcheck source=scripts/debian_root.sh
source "$root/scripts/debian_root.sh"

workspace=$build/.workspace

# Of a copy, for a link into the tree would be a circle; built in the copy, as build/.ros is in the tree,
# so that the cache of compilations serves both. The tests' programs go beside the installed ones, where
# rostest looks for them; they find the installed library by the same way.
make_workspace() {
  local package=$workspace/src/walker_sim file
  rm -rf "$workspace" && mkdir -p "$package" && cd "$root" &&
    tar -c --exclude=./build --exclude=./devel --exclude=./.git . | tar -x -C "$package"
  cp -r "$package/examples/my_walker_pkg" "$workspace/src/" # as a user does, beside the package
  cd "$workspace"
  within "$ros_setup" catkin_make --build "$package/build" -j"$jobs" -l"$((jobs * 2))" install \
    "${ros_options[@]}" -DCATKIN_DEVEL_PREFIX="$package/devel" -DWALKER_SIM_WERROR=ON
  if find "$package/build" -path '*.dir/test/*.o' | grep .; then
    die "catkin_make has compiled tests: nobody has asked for them"
  fi
  [ -x install/lib/my_walker_pkg/episode ] || die "catkin_make has not built my_walker_pkg"
  rm -rf "$package" install/lib/my_walker_pkg install/share/my_walker_pkg # nothing installed may need it
  for file in "$devel/lib/walker_sim/"*; do
    [ -e "install/lib/walker_sim/${file##*/}" ] || cp -P "$file" install/lib/walker_sim/
  done
}

# Where no more is in sight than what the setup file $1 brings.
in_space() {
  # shellcheck disable=SC2016  # for the inner shell
  env -i HOME="$HOME" PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 ROS_HOSTNAME=localhost \
    ROS_HOME="$ros_home" PYTHONDONTWRITEBYTECODE=1 bash -c 'source "$0" && exec "$@"' "$@"
}

# Not with rostest's --text, which would report no failure.
run_installed() {
  local kind=$1 file=$2 results=$3 command
  mkdir -p "${results%/*}"
  if [ "$kind" = rostest ]; then # whose file is BASE/PACKAGE/rostest-NAME.xml
    command=(rostest --pkgdir="$root" --package=walker_sim --results-filename="${results##*/rostest-}"
      --results-base-dir="$(dirname "${results%/*}")" "$file")
  else
    command=("$venv/bin/python" -m pytest -q -p no:cacheprovider --noconftest --junit-xml="$results" "$file")
  fi
  ros_home=${results%.xml}_ros_home
  in_space "$workspace/install/setup.bash" "${command[@]}"
}

# A workspace of a user's, on top of walker_sim's install space: tested in the devel space, and once
# more in the install space, for which alone what is installed has to do.
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

# build/.wheel/VERSION/*.whl, as a user makes it; not again where no file of ours has changed since.
build_wheel() {
  local version folder environment
  version=$(version_of "$1")
  folder=$build/.wheel/$version
  if [ -e "$folder/ready" ] && [ -z "$(find_files ! -name '*.pyc' -newer "$folder/ready")" ]; then
    return
  fi
  environment=$build/.wheel/${version}_pip # Debian 11's own takes no settings, and copies the tree
  set_up_venv "wheel $version" "$environment" "$root/test/python/wheel_pip.txt" "$1"
  mkdir -p "$folder" && rm -f "$folder/ready" "$folder"/*.whl && touch "$folder/ready.new"
  within /dev/null env CXX="${CXX:-/usr/bin/c++}" "$environment/bin/python" -m pip wheel \
    --disable-pip-version-check --no-deps --wheel-dir "$folder" \
    --config-settings=build-dir="$build/.wheel_$version" \
    --config-settings=cmake.define.WALKER_SIM_WERROR=ON "$root"
  mv "$folder/ready.new" "$folder/ready"
}

# Where no ROS and no other package is in sight. test/python/wheel_oldest.txt and wheel_newest.txt say
# what is beside the wheel.
run_wheel_suite() {
  local interpreter=$1 which=$2 results=$3 version environment pip=()
  version=$(version_of "$interpreter")
  environment=$build/.wheel/${version}_$which
  set_up_venv "wheel $version $which" "$environment" "$root/test/python/wheel_$which.txt" "$interpreter"
  pip=("$environment/bin/python" -m pip --disable-pip-version-check)
  within /dev/null "${pip[@]}" install --no-index --no-deps --force-reinstall "$build/.wheel/$version"/*.whl
  within /dev/null "${pip[@]}" check
  mkdir -p "${results%/*}"
  exec env -i HOME="$HOME" PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 PYTHONDONTWRITEBYTECODE=1 \
    ROS_HOME="$build/.wheel/ros_home" WALKER_SIM_DEVEL="$devel" "$environment/bin/python" -m pytest -q \
    -p no:cacheprovider --noconftest --junit-xml="$results" "$root/test/python/wheel_test.py"
}

# As a user: a fresh environment, the wheel with its extra, and nothing compiled for that.
run_wheel_readme() {
  local interpreter=$1 results=$2 environment wheel
  environment=$build/.wheel/$(version_of "$interpreter")_readme
  rm -rf "$environment" && within /dev/null "$interpreter" -m venv "$environment"
  wheel=$(echo "$build/.wheel/$(version_of "$interpreter")"/*.whl)
  within /dev/null "$environment/bin/python" -m pip install --disable-pip-version-check -q \
    --only-binary=:all: "${wheel}[box2d]" pytest
  mkdir -p "${results%/*}"
  exec env -i HOME="$HOME" PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 PYTHONDONTWRITEBYTECODE=1 \
    "$environment/bin/python" -m pytest -q -p no:cacheprovider --noconftest --junit-xml="$results" \
    "$root/test/python/readme_wheel_test.py"
}

run_example() {
  local learner=$1 suite=$2 results=$3
  mkdir -p "${results%/*}"
  within "$devel/setup.bash" env ROS_HOSTNAME=localhost PYTHONDONTWRITEBYTECODE=1 \
    ROS_HOME="$build/.examples/ros_home" WALKER_SIM_PROGRAMS="$devel/lib/walker_sim" \
    "$(example_venv "$learner")/bin/python" -m pytest -q -p no:cacheprovider --junit-xml="$results" "$suite"
}

# The source package of the release that is installed, by the hashes of the same lock file.
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
  local results=$1 sources=$build/.examples/sb3_sources
  fetch_sb3_sources "$sources"
  mkdir -p "${results%/*}"
  within "$devel/setup.bash" env PYTHONDONTWRITEBYTECODE=1 "$(example_venv sb3)/bin/python" \
    "$root/test/python/suites.py" sb3 "$sources" --junit-xml="$results"
}

rosnodejs=$build/.rosnodejs

# By the hashes of package-lock.json, unless that is done already. No package's script is run.
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
  local suite=$1 results=$2
  mkdir -p "${results%/*}"
  within "$devel/setup.bash" env ROS_HOSTNAME=localhost PYTHONDONTWRITEBYTECODE=1 \
    ROS_HOME="$rosnodejs/ros_home" WALKER_SIM_PROGRAMS="$devel/lib/walker_sim" WALKER_SIM_ROSNODEJS="$rosnodejs" \
    "$venv/bin/python" -m pytest -q -p no:cacheprovider --junit-xml="$results" "$suite"
}

# TorchRL asks for a later PyTorch than Debian 12 has, and pip's brings gigabytes for GPUs. So Debian 13's
# own is taken, in a folder; beside it what the requirements pin and, each time anew, the wheel for its
# Python, which is the PYTHON of this system too.
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
  local suite=$1 results=$2 place=/opt/walker_sim status=0
  as_root rm -rf "$torchrl_root$place" && as_root mkdir -p "$torchrl_root$place/test" &&
    as_root cp -r "$root/examples" "$torchrl_root$place" &&
    as_root cp -r "$root/test/examples" "$torchrl_root$place/test"
  as_root chroot "$torchrl_root" /usr/bin/env -i HOME=/root PATH=/usr/bin:/bin LANG=C.UTF-8 \
    PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=/opt/packages python3 -m pytest -q -p no:cacheprovider \
    --junit-xml="$place/results.xml" "$place/${suite#"$root/"}" || status=$?
  mkdir -p "${results%/*}" && cp "$torchrl_root$place/results.xml" "$results"
  return "$status"
}

check_system
case $1 in
  workspace) make_workspace ;;
  installed) run_installed "${@:2}" ;;
  my_walker_pkg) run_my_walker_pkg ;;
  wheel) build_wheel "$2" ;;
  wheel_suite) run_wheel_suite "${@:2}" ;;
  wheel_readme) run_wheel_readme "${@:2}" ;;
  example_venv) set_up_example "$2" ;;
  example) run_example "${@:2}" ;;
  sb3_suite) run_sb3_suite "$2" ;;
  rosnodejs_modules) set_up_rosnodejs ;;
  rosnodejs) run_rosnodejs "${@:2}" ;;
  torchrl_root) set_up_torchrl_root "$2" ;;
  torchrl) run_torchrl_example "${@:2}" ;;
  *) die "$1: unknown command" ;;
esac
