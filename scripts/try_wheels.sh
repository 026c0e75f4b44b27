# shellcheck shell=bash
# Tests of ./scripts/wheels for the wheels that it has built. Source it after setup.sh and
# debian_root.sh. The functions read pythons, wheel_dir and version, and update trials and failures.
# shellcheck disable=SC2154

suites=(bullseye bookworm trixie)
declare -A suite_names=([bullseye]="Debian 11" [bookworm]="Debian 12" [trixie]="Debian 13")
picture_packages=(libcairo2 libosmesa6)

# fetch_requirements VERSION PROGRAM: collects the wheel and its requirements, as pip would choose
# them for Debian 11, in build/.wheelhouse/VERSION.
fetch_requirements() {
  local name=$1 house=$build/.wheelhouse/$1 wheel platforms=() x
  wheel=$(ls "$wheel_dir/walker_sim-$version-cp${name/./}-"*.whl) || return
  for x in 31 28 27 24 17; do platforms+=(--platform "manylinux_2_${x}_$(uname -m)"); done
  rm -rf "$house" && mkdir -p "$house" || return
  quiet "requirements_$name" within /dev/null env -u PIP_REQUIRE_VIRTUALENV "$2" -m pip download --disable-pip-version-check \
    --only-binary=:all: "${platforms[@]}" --platform "manylinux2014_$(uname -m)" --dest "$house" "$wheel"
}

# try_wheel WHERE VERSION LOG CMD...: runs CMD, which calls test/python/try_wheel.py, and reports.
try_wheel() {
  local where=$1 name=$2 log=$logs/try_wheel_$3.log
  trials=$((trials + 1))
  echo "$where, Python $name"
  if "${@:4}" >"$log" 2>&1 </dev/null; then
    sed -n 's/^= /  /p' "$log"
  else
    tail -n 20 "$log" | sed 's/^/  | /'
    failures+=("$where, Python $name: build/log/${log##*/}")
  fi
}

# try_here VERSION PROGRAM: tests the wheel in an empty virtual environment of this system.
try_here() {
  local name=$1 program=$2 environment=$work/trial_$1
  # shellcheck disable=SC2016  # for the inner shell
  try_wheel "here" "$name" "here_$name" within /dev/null env -i HOME="$HOME" PATH=/usr/bin:/bin LANG=C.UTF-8 bash -ec '
    rm -rf "$1" && "$2" -m venv "$1"
    "$1/bin/python" -m pip install --disable-pip-version-check --no-cache-dir --only-binary=:all: "$3"
    "$1/bin/python" -I "$4" any' - \
    "$environment" "$program" "$(echo "$wheel_dir/walker_sim-$version-cp${name/./}-"*.whl)" \
    "$root/test/python/try_wheel.py"
}

# try_in_root ROOT WHERE VERSION PROGRAM drawn|missing: tests the wheel in the root, where pictures
# are drawn or their libraries are missing. pip is given all wheels and must choose the right one.
try_in_root() {
  local debian=$1 name=$3 place
  place=$debian/trial/$name
  rm -rf "$place" && mkdir -p "$place/test/python" "$place/test/recordings" || return
  cp -r "$build/.wheelhouse/$name" "$place/wheels" && cp "$wheel_dir"/*.whl "$place/wheels" &&
    cp "$root/test/python/"{try_wheel,recorded_episodes}.py "$place/test/python" &&
    cp "$root/test/recordings/"*full_episodes.txt "$place/test/recordings" || return
  # shellcheck disable=SC2016  # for the inner shell
  try_wheel "$2" "$name" "${2// /_}_$name" in_debian_root "$debian" bash -ec '
    cd "/trial/$1"
    "$2" -m venv environment
    environment/bin/python -m pip install --disable-pip-version-check --no-cache-dir --no-index \
      --find-links wheels walker_sim
    environment/bin/python -I test/python/try_wheel.py --bare "$3"' - "$name" "$4" "$5"
}

# copy_python ROOT PROGRAM: copies a Python installation without its packages and its own tests.
copy_python() {
  local prefix
  prefix=$("$2" -I -c 'import sys; print(sys.prefix)')
  mkdir -p "$1$prefix" && tar -C "$prefix" --exclude=site-packages --exclude='lib/python3.*/test' -c . |
    tar -x -C "$1$prefix"
}

# try_on SUITE: tests with the distribution's own Python and with this system's that run there.
try_on() {
  local suite=$1 debian=$debian_roots/$1 where=${suite_names[$1]} line name program own
  make_debian_root "$debian" "$suite" python3-venv || return
  own=$(in_debian_root "$debian" python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  [[ " ${pythons[*]%% *} " = *" $own "* ]] || say "$where has Python $own, which there is no wheel for"
  for line in "${pythons[@]}"; do
    name=${line%% *} program=${line#* }
    if [ "$name" = "$own" ]; then
      program=/usr/bin/python3
    elif [[ $program = /usr/bin/* ]]; then
      say "$where has no Python $name, and this system's cannot be taken there"
      continue
    else
      copy_python "$debian" "$program" || return
      if ! in_debian_root "$debian" "$program" -c '' 2>/dev/null; then
        say "$where has no Python $name, and this system's does not run there"
        continue
      fi
    fi
    try_in_root "$debian" "$where" "$name" "$program" missing || return
    if [ "$name" = "$own" ]; then
      make_debian_root "$debian.pictures" "$suite" python3-venv "${picture_packages[@]}" &&
        try_in_root "$debian.pictures" "$where with ${picture_packages[*]}" "$name" "$program" drawn || return
      rm -rf "$debian.pictures"
    fi
  done
  rm -rf "$debian"
}

try_all() {
  local line suite
  if [ "$here" = yes ]; then
    # shellcheck disable=SC2086  # two words
    for line in "${pythons[@]}"; do try_here $line; done
    return
  fi
  # shellcheck disable=SC2086  # two words
  for line in "${pythons[@]}"; do
    fetch_requirements $line || failures+=("what the wheel for Python ${line%% *} requires")
  done
  for suite in "${suites[@]}"; do
    try_on "$suite" || failures+=("${suite_names[$suite]}: a root with the wheels in it")
  done
}
