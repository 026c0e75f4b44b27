# shellcheck shell=bash
# Root file systems of Debian's releases, made by debootstrap: for compiling, and clean ones for testing
# wheels and packages. Source it after setup.sh. Nothing is mounted in them, so rm -rf removes each.
# shellcheck disable=SC2034,SC2154  # what others use, and what setup.sh sets

debian_roots=$build/.debian # hidden, because roslaunch searches visible folders
compile_root=$debian_roots/compile
debian_11_glibc=2_31

# Prints WALKER_SIM_DEBIAN_MIRROR if set, else the mirror of this system's apt, else Debian's own.
debian_mirror() {
  local found=${WALKER_SIM_DEBIAN_MIRROR:-}
  # shellcheck disable=SC2016  # apt's variable
  [ -n "$found" ] || found=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' \
    'Origin: Debian' 'Label: Debian' 'Component: main' | head -n 1) || found=''
  echo "${found:-http://deb.debian.org/debian}"
}

# debian_archive SUITE PACKAGE...: prints the tar file of a minimal Debian with these packages, and
# makes it if necessary.
debian_archive() {
  local suite=$1 packages=("${@:2}") name root includes
  name=$suite-$(printf '%s\n' "$@" | sha256sum | head -c 8)
  if [ ! -e "$debian_roots/$name.tar" ]; then
    say "Debian's $suite: fetching it, with ${packages[*]}"
    mkdir -p "$debian_roots/packages"
    # An interrupted debootstrap may have left something mounted.
    rm -rf --one-file-system "$debian_roots"/unfinished.* || true
    root=$(mktemp -d "$debian_roots/unfinished.XXXXXX") && chmod 755 "$root"
    includes=$(IFS=,; echo "${packages[*]}")
    quiet "debootstrap_$suite" debootstrap --variant=minbase --cache-dir="$debian_roots/packages" \
      --include="$includes" "$suite" "$root" "$(debian_mirror)" || {
      say "Debian's $suite cannot be downloaded from $(debian_mirror); WALKER_SIM_DEBIAN_MIRROR may name another server"
      return 1
    }
    rm -rf "$root"/var/cache/apt/archives/*.deb
    tar -C "$root" -cf "$root.tar" . && mv "$root.tar" "$debian_roots/$name.tar" && rm -rf "$root"
  fi
  echo "$debian_roots/$name.tar"
}

# make_debian_root DIR SUITE PACKAGE...: makes a clean root in DIR.
make_debian_root() {
  local root=$1 archive
  archive=$(debian_archive "${@:2}") || return
  rm -rf "$root" && mkdir -p "$root" && chmod 755 "$root" && tar -C "$root" -xf "$archive"
}

# make_root DIR SUITE: makes a clean root whose apt reaches its server.
make_root() { make_debian_root "$1" "$2" ca-certificates && copy_resolver "$1"; }

# copy_resolver DIR: lets the root resolve names as this system does.
copy_resolver() { [ ! -e /etc/resolv.conf ] || cp /etc/resolv.conf "$1/etc/"; }

# copy_tree DIR: copies our files there, without build products.
copy_tree() {
  tar -C "$root" -c --exclude-vcs --exclude=./build --exclude=./devel --exclude=__pycache__ --exclude=.ruff_cache \
    --exclude=.pytest_cache --exclude='_core*.so' . | tar -C "$1" -x
}

# lock_debian_roots: fails if another command uses the roots.
lock_debian_roots() {
  mkdir -p "$debian_roots"
  exec 9>"$debian_roots/lock"
  flock -n 9 || die "another command uses $debian_roots; wait for its end"
}

# find_engines: exports the variables that name the engines' directories, and fetches what none names.
find_engines() {
  BOX2D_SOURCE_DIR=${BOX2D_SOURCE_DIR:-$("$root/scripts/fetch_engines" box2d)} &&
    MUJOCO_DIR=${MUJOCO_DIR:-$("$root/scripts/fetch_engines" mujoco)} && export BOX2D_SOURCE_DIR MUJOCO_DIR
}

# copy_engines DIR: copies the engines to DIR/box2d and DIR/mujoco.
copy_engines() {
  find_engines && mkdir -p "$1/box2d" "$1/mujoco" &&
    cp -a "$BOX2D_SOURCE_DIR/." "$1/box2d" && cp -a "$MUJOCO_DIR/." "$1/mujoco"
}

change_root=(chroot) # no /proc: most containers may not mount one
change_root_with_proc=(unshare --pid --fork --kill-child --mount-proc --root)

# in_debian_root DIR CMD...: runs CMD in the root, without this system's environment variables.
in_debian_root() {
  "${change_root[@]}" "$1" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 "${@:2}"
}

# make_compile_root DIR: Debian 11 with its compiler, whose glibc is the oldest that our wheels
# support. The root has ccache, because the wheels differ in the bindings only.
make_compile_root() {
  local root=$1
  make_debian_root "$root" bullseye ccache g++ libcairo2-dev libegl-dev libeigen3-dev libosmesa6-dev ||
    return
  # The root links to itself, so that paths below DIR are the same inside and outside.
  mkdir -p "$root${root%/*}" && ln -s / "$root$root"
  # The compiler for CMake and pip, which run outside.
  mkdir -p "$root/work" && cat >"$root/work/c++" <<END_OF_COMPILER
#!/bin/sh
exec chroot '$root' /usr/bin/env -C "\$PWD" PATH=/usr/bin:/bin CCACHE_DIR='$root/work/ccache' \\
  CCACHE_BASEDIR='$root/work' CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros \\
  /usr/bin/ccache /usr/bin/c++ "\$@"
END_OF_COMPILER
  chmod +x "$root/work/c++"
}

# show_sources ROOT PYTHON: copies this system's sources that are compiled in the root, to the same
# paths: PYTHON's headers, and the programs with which CMake identifies a compiler.
show_sources() {
  local root=$1 folder folders
  mapfile -t folders < <("$2" -I - <<'END_OF_PROGRAM'
import sysconfig

include = sysconfig.get_path("include")
print(include)
# Debian's header for all its architectures includes that of one.
print("/usr/include/%s/%s" % (sysconfig.get_config_var("MULTIARCH"), include.rpartition("/")[2]))
END_OF_PROGRAM
  )
  folders+=(/usr/share/cmake*/Modules) # without CMake here, pip installs one that the root sees
  for folder in "${folders[@]}"; do
    if [ -d "$folder" ]; then
      mkdir -p "$root$folder" && cp -aL "$folder/." "$root$folder/" || return
    fi
  done
}
