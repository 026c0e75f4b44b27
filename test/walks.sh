#!/usr/bin/env bash
# Runs README's first command, including the set-up on a new machine. Passes if the walker arrives, there
# is a page, and Ctrl-C ends everything.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
mkdir -p build/log
log=$PWD/build/log/walks.log
# A free port, because other tests may run on the same machine.
port=$(PYTHONPATH=$PWD/test python3 -c 'from processes import free_port; print(free_port())' 2>/dev/null || echo 11311)
ROS_MASTER_URI=http://localhost:$port env -u DISPLAY setsid ./scripts/run >"$log" 2>&1 </dev/null &
walker=$!
trap 'kill -INT -- "-$walker" 2>/dev/null || true' EXIT

# within SECONDS CMD...: waits until CMD succeeds; fails after SECONDS.
within() {
  local left=$1
  shift
  until "$@"; do
    if [ "$left" -eq 0 ]; then
      tail -n 40 "$log"
      echo "walks: not within $((SECONDS)) s: $*"
      exit 1
    fi
    left=$((left - 1))
    sleep 1
  done
}
has_ended() { ! kill -0 "$walker" 2>/dev/null; }
# Matches `BipedalWalker-v3  time  14.04 s ... return  +301.7`.
has_arrived() { has_ended || grep -qE '^BipedalWalker-v3 .* return +\+(29[0-9]|3[0-9][0-9])' "$log"; }

has_page() { has_ended || grep -qE '^page of /walker_sim: http://127\.0\.0\.1:[0-9]+/\?token=' "$log"; }

within 3600 has_arrived
within 60 has_page
if has_ended; then
  tail -n 40 "$log"
  echo "walks: ./scripts/run ended by itself"
  exit 1
fi
grep -E '^BipedalWalker-v3 ' "$log" | tail -n 3
kill -INT -- "-$walker"
within 60 has_ended
