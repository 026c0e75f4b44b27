#!/usr/bin/env bash
# README's walker without ROS. Passes if the commands of docs/install.md and README, unchanged, install
# walker_sim with pip and the walker arrives. Runs as root on a clean machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# block FILE WORDS: prints the code block that contains these words.
block() {
  awk -v words="$2" '/^```/ { if (found) { printf "%s", text; exit } text = ""; next }
    { text = text $0 "\n"; if (index($0, words)) found = 1 }' "$1"
}

home=$(mktemp -d)
trap 'rm -rf "$home"' EXIT
readme=$(block README.md 'python3 -m walker_sim play')
{
  block docs/install.md 'apt-get install' | sed -E 's/^sudo //; s/apt-get install/& -y -q --no-install-recommends/; /^pip/d'
  head -n 1 <<<"$readme"
  sed -n 's/ play / evaluate /p' <<<"$readme"
} >"$home/commands"
cat "$home/commands"
# Like `apt-get install -t bullseye`: Debian 11's security archive lists packages that it no longer has.
if grep -q '^VERSION_ID="11"' /etc/os-release; then
  echo 'APT::Default-Release "bullseye";' >"$home/apt.conf"
  export APT_CONFIG=$home/apt.conf
fi
HOME=$home bash -eux "$home/commands" | tee "$home/said"
awk '/mean return/ { arrived = $3 > 290 } END { exit !arrived }' "$home/said" ||
  { echo "pip_walks: the walker does not arrive" && exit 1; }
