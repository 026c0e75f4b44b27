"""Exported headers and libraries: programs build with only pkg-config's flags."""

import os
import re
import shlex
import subprocess

import pytest

LIBRARY = """
#include <walker_sim/client.h>
#include <walker_sim/pool.h>
#include <walker_sim/registry.h>

#include <cstdio>
#include <vector>

int main() {
  walker::PoolOptions options;
  options.num_envs = 2;
  walker::Pool pool([] { return walker::make("Walker2d-v5"); }, options);
  std::vector<double> observations(2 * 17);
  walker::Batch batch;
  batch.observations = observations.data();
  pool.reset({}, {}, batch);
  walker::ClientOptions client;
  client.master_uri = "http://localhost:1";
  try {
    walker::Client{client};
  } catch (const walker::ConnectionError& error) {
    std::printf("%.2f %s\\n", observations[0], error.what());
  }
}
"""
MESSAGES = """
#include <ros/serialization.h>
#include <walker_sim/Render.h>
#include <walker_sim/StepMany.h>

#include <cstdio>
#include <vector>

int main() {
  walker_sim::Transition transition;
  transition.observation.resize(24);
  const std::uint32_t size = ros::serialization::serializationLength(transition);
  std::vector<std::uint8_t> bytes(size);
  ros::serialization::OStream stream(bytes.data(), size);
  ros::serialization::serialize(stream, transition);
  walker_sim::Render render;
  std::printf("%u %s\\n", size, ros::service_traits::datatype(render));
}
"""


def flags(*options):
    done = subprocess.run(
        ["pkg-config", *options, "walker_sim"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return shlex.split(done.stdout)


@pytest.mark.parametrize(
    "program, output",
    [(LIBRARY, r"^1\.2\d .*http://localhost:1"), (MESSAGES, r"^2\d\d walker_sim/Render$")],
    ids=["library", "messages"],
)
def test_program_compiles_links_and_runs(program, output, tmp_path):
    (tmp_path / "main.cpp").write_text(program, encoding="utf-8")
    command = ["c++", "-std=c++17", "-o", "main", "main.cpp", *flags("--cflags", "--libs")]
    built = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    done = subprocess.run(["./main"], cwd=tmp_path, stdout=subprocess.PIPE, text=True, check=True)
    assert re.search(output, done.stdout.strip()), done.stdout


def test_nothing_else_is_linked():
    libraries = {flag for flag in flags("--libs") if flag.startswith("-l")}
    messages = {"-lroscpp_serialization", "-lrostime", "-lcpp_common"}
    assert libraries == {"-lwalker_sim_core", *messages}


def test_folders_are_those_of_this_space():
    space = os.environ["CMAKE_PREFIX_PATH"].split(":")[0]
    assert f"-L{space}/lib" in flags("--libs-only-L")
    folders = [flag[2:] for flag in flags("--cflags-only-I")]
    assert f"{space}/include" in folders
    # On Debian 13, rostime and similar packages omit their prefix.
    assert all(os.path.isdir(folder) for folder in folders if folder != "/include")
