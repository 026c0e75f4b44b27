# shellcheck shell=bash
# The stage `examples` of ./scripts/test: each file of examples/ as a user runs it, and the suites that
# need the same large packages. Sourced after setup.sh.
# shellcheck disable=SC2154  # names shared with setup.sh and test

# The virtual environment, build/.examples/NAME from test/examples/requirements_NAME.txt, and the suite.
# Hidden, for roslaunch walks through a package's visible folders.
example_suites=(
  "sb3 test/python/sb3_test.py"
  "sb3 test/examples/sb3_ppo_test.py"
  "gymnasium test/examples/cleanrl_ppo_test.py"
  "gymnasium test/examples/ray_rollouts_test.py"
)

# set_up_example VENV. The distribution's PyTorch, for pip's brings gigabytes for GPUs; pip does not
# see it, so the requirements are complete and pip has to look for no more.
set_up_example() {
  local missing
  mapfile -t missing < <(missing_packages "${example_packages[@]}")
  if [ ${#missing[@]} -gt 0 ]; then
    say "examples: installing ${missing[*]} and what they need"
    quiet example_packages install_packages "${missing[@]}" 8>&- 9>&- || return
  fi
  PIP_NO_DEPS=1 set_up_venv "examples/$1" "$build/.examples/$1" \
    "$root/test/examples/requirements_$1.txt"
}

# run_example_suite NAME VENV SUITE
run_example_suite() {
  local name=$1 venv=$2 suite=$3 status=0
  local log=$logs/${name//\//_}.log results=$build/.examples/test_results/$name.xml
  if ! locked set_up_example "$venv"; then
    record step "$name: set-up" 1 "$logs"
    return
  fi
  mkdir -p "${results%/*}" && rm -f "$results"
  within "$devel/setup.bash" env ROS_HOSTNAME=localhost PYTHONDONTWRITEBYTECODE=1 \
    ROS_HOME="$build/.examples/test_results/ros_home" WALKER_SIM_PROGRAMS="$devel/lib/walker_sim" \
    timeout --kill-after=30 600 "$build/.examples/$venv/bin/python" -m pytest -q \
    -p no:cacheprovider --junit-xml="$results" "$root/$suite" >"$log" 2>&1 </dev/null 8>&- ||
    status=$?
  say "examples: $name status $status"
  record pytest "$name" "$status" "$log" "$results"
}

run_examples() {
  local entry venv suite name
  if [ ${#example_packages[@]} -eq 0 ]; then
    say "examples: left out, for this system has no package of PyTorch"
    return
  fi
  for entry in "${example_suites[@]}"; do
    read -r venv suite <<<"$entry"
    name=examples/$(basename "$suite" _test.py)
    if selected "$name"; then run_example_suite "$name" "$venv" "$suite"; fi
  done
}
