# shellcheck shell=bash
# The lints of ./scripts/test: one function each, its output is its report, its status its verdict.
# A lint that finds no file to look at fails. Sourced after setup.sh.
# shellcheck disable=SC2034,SC2154  # names shared with setup.sh and test

lints=(lint_clang_format lint_clang_tidy lint_cppcheck lint_catkin lint_ruff_check
  lint_ruff_format lint_mypy lint_shellcheck lint_rooms)

# find_files EXPRESSION...: our files, without what was built.
find_files() {
  find "$root" \( -path "$root/build" -o -path "$root/.git" \) -prune -o -type f "$@" -print
}

# Our files with the extension $1, and those without any whose first line names $2.
scripts_of() {
  find_files -name "*.$1"
  # shellcheck disable=SC2016  # for awk
  find_files ! -name '*.*' | xargs -d '\n' -r awk -v what="$2" \
    'FNR == 1 && /^#!/ && index($0, what) { print FILENAME }'
}

# on_files COMMAND...: COMMAND with all files that standard input names; an error without any.
on_files() {
  local files
  mapfile -t files
  if [ ${#files[@]} -eq 0 ]; then
    echo "no file to look at"
    return 1
  fi
  "$@" "${files[@]}"
}

lint_clang_format() {
  find_files \( -name '*.h' -o -name '*.cpp' \) | on_files clang-format --dry-run --Werror
}

# Each file of ours that the pinned build compiles, as many at a time as there are cores.
lint_clang_tidy() {
  /usr/bin/python3 - "$ros_build/compile_commands.json" "$root" <<'END' |
import json, os, sys
with open(sys.argv[1]) as file:
    compiled = {os.path.realpath(entry["file"]) for entry in json.load(file)}
for folder in ("src", "test"):
    print(*sorted(f for f in compiled if f.startswith(f"{sys.argv[2]}/{folder}/")), sep="\n")
END
    grep . | on_files printf '%s\0' | xargs -0 -n 1 -P "$jobs" clang-tidy --quiet -p "$ros_build" \
    --header-filter="^$root/(include|src|test)/" --extra-arg=-Wno-unknown-warning-option
}

# constStatement is left to the compiler's -Wunused-value: cppcheck misreads double{x} as a statement.
lint_cppcheck() {
  find_files -name '*.cpp' | on_files cppcheck --enable=warning,performance,portability \
    --inline-suppr --error-exitcode=1 --std=c++17 --library=googletest --quiet -j "$jobs" \
    --suppress=constStatement -I "$root/include" -I "$root/src" -I "$root/test"
}

lint_catkin() {
  within "$ros_setup" catkin_lint -W2 --strict --offline --config "$root/.catkin_lint" "$root"
}

lint_ruff_check() { scripts_of py python3 | on_files "$venv/bin/ruff" check --no-cache; }

lint_ruff_format() {
  scripts_of py python3 | on_files "$venv/bin/ruff" format --no-cache --check --diff
}

# The package alone, with the types of what it stands on out of the virtual environment.
lint_mypy() (cd "$root" && "$venv/bin/mypy" --config-file pyproject.toml)

lint_shellcheck() { scripts_of sh bash | on_files shellcheck -x; }

# Who may include what: no ROS in the core, no engine outside its room, and no word of MuJoCo where
# the abstract environment is enough. Fails also where a room is missing, for grep then says 2.
lint_rooms() (
  local ros box2d mujoco status=0
  cd "$root" || exit
  ros='#include *[<"](ros/|roscpp|rosgraph|tf2|diagnostic_updater|message_filters|rosbag|[a-z0-9_]*_(msgs|srvs)/|walker_sim/[A-Z])'
  box2d='#include *[<"][Bb]ox2[dD]/'
  mujoco='#include *[<"]mujoco/'
  grep -rnE "$ros" include src/client src/core src/bipedal_walker src/walker2d
  [ $? -eq 1 ] || { echo "a ROS header in a room without ROS"; status=1; }
  grep -rnE --exclude-dir=bipedal_walker "$box2d" include src
  [ $? -eq 1 ] || { echo "a Box2D header outside src/bipedal_walker"; status=1; }
  grep -rnE --exclude-dir=walker2d "$mujoco" include src test
  [ $? -eq 1 ] || { echo "a MuJoCo header outside src/walker2d and test/walker2d"; status=1; }
  grep -rni mujoco include src/core src/server src/agents src/nodes msg srv
  [ $? -eq 1 ] || { echo "MuJoCo in a room that knows the abstract environment only"; status=1; }
  exit $status
)
