# shellcheck shell=bash
# The stage `wheel` of ./scripts/test: pip's wheel in clean virtual environments, once for each Python
# here, with the oldest and the newest packages. All in a hidden folder, for roslaunch walks through a
# package's visible ones. Sourced after setup.sh and lint.sh.
# shellcheck disable=SC2154  # names shared with setup.sh and test

# VERSION PROGRAM, a line for each Python 3.10 to 3.13: the distribution's, those on PATH, pyenv's.
wheel_pythons() {
  local python
  for python in /usr/bin/python3 python3.{10..13} ~/.pyenv/versions/3.1[0-3].*/bin/python3; do
    "$python" -I -c 'import ensurepip, pip, sys
version = sys.version_info[:2]
if (3, 10) <= version <= (3, 13):
    print("%d.%d" % version, sys.executable)' 2>/dev/null || true # not there, or not whole
  done | sort -u -s -k 1,1
}

# build_wheel FOLDER PYTHON: FOLDER/*.whl, by pip as a user does it; not again where no file of ours
# has changed since.
build_wheel() {
  local folder=$1 python=$2
  if [ -e "$folder/ready" ] &&
    [ -z "$(find_files ! -name '*.pyc' -newer "$folder/ready" | head -n 1)" ]; then
    return
  fi
  say "wheel: building it in build/.wheel/${folder##*/}"
  mkdir -p "$folder" && rm -f "$folder/ready" "$folder"/*.whl && touch "$folder/ready.new" &&
    quiet "build_wheel_${folder##*/}" within /dev/null env -u PIP_REQUIRE_VIRTUALENV "$python" \
      -m pip wheel --disable-pip-version-check --no-deps --wheel-dir "$folder" "$root" &&
    mv "$folder/ready.new" "$folder/ready"
}

# install_wheel WHEEL VENV
install_wheel() {
  local pip=("$2/bin/python" -m pip --disable-pip-version-check)
  within /dev/null "${pip[@]}" install --no-index --no-deps --force-reinstall "$1" &&
    within /dev/null "${pip[@]}" check
}

# run_wheel_suite NAME PYTHON: test/python/wheel_test.py, where no ROS and no other package is in
# sight. NAME is wheel/VERSION/SET; test/python/wheel_SET.txt says what is beside the wheel.
run_wheel_suite() {
  local name=$1 python=$2 folder=$build/.${1%/*} venv=$build/.$1 set=${1##*/} status=0
  local log=$logs/${name//\//_}.log results=$build/.wheel/test_results/${name//\//_}.xml
  if ! set_up_venv "$name" "$venv" "$root/test/python/wheel_$set.txt" "$python" ||
    ! quiet install_wheel install_wheel "$folder"/*.whl "$venv"; then
    record step "$name: set-up" 1 "$logs"
    return
  fi
  mkdir -p "${results%/*}" && rm -f "$results"
  env -i HOME="$HOME" PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 PYTHONDONTWRITEBYTECODE=1 \
    ROS_HOME="$build/.wheel/ros_home" WALKER_SIM_DEVEL="$devel" timeout --kill-after=30 300 \
    "$venv/bin/python" -m pytest -q -p no:cacheprovider --noconftest --junit-xml="$results" \
    "$root/test/python/wheel_test.py" >"$log" 2>&1 </dev/null 8>&- || status=$?
  say "wheel: $name status $status"
  record pytest "$name" "$status" "$log" "$results"
}

run_wheel() {
  local pythons version python set
  mapfile -t pythons < <(wheel_pythons)
  if [ ${#pythons[@]} -eq 0 ] && selected wheel/; then
    record step "wheel: no whole Python 3.10 to 3.13 is here" 1 "$logs"
  fi
  for python in "${pythons[@]}"; do
    version=${python%% *}
    for set in oldest newest; do
      selected "wheel/$version/$set" || continue
      if locked build_wheel "$build/.wheel/$version" "${python#* }"; then
        run_wheel_suite "wheel/$version/$set" "${python#* }"
      else
        record step "wheel/$version: build" 1 "$logs/build_wheel_$version.log"
        break
      fi
    done
  done
}
