"""The package: import requirements, registered ids, and errors if its parts come from two
installations."""

import functools
import os
import pathlib
import shutil
import sys
import xml.etree.ElementTree as ElementTree

import gymnasium
import pytest
import walker_sim
from walker_sim import _core
from walkers import IDS, run_python

SOURCE = pathlib.Path(__file__).parents[2]
WITH_CORE = pathlib.Path(_core.__file__).parents[1]
MAKE = "gymnasium.make('walker_sim/BipedalWalker-v3').reset(seed=1)"


def last_line(program, *folders, status=0):
    path = os.pathsep.join(map(str, folders))
    return "".join(run_python(program, PYTHONPATH=path, status=status)).strip().splitlines()[-1]


@pytest.fixture()
def files(tmp_path):
    ignored = shutil.ignore_patterns("*.so", "__pycache__")
    shutil.copytree(SOURCE / "src/python/walker_sim", tmp_path / "walker_sim", ignore=ignored)
    return tmp_path


def test_versions_agree():
    version = ElementTree.parse(SOURCE / "package.xml").findtext("version")
    assert walker_sim.__version__ == version
    assert _core.__version__ == version


def test_ids_equal_the_cores():
    assert walker_sim.ids() == [f"walker_sim/{env_id}" for env_id in _core.ids()]
    assert sorted(_core.ids()) == sorted(IDS)


@pytest.mark.parametrize("env_id", IDS)
def test_registrations_equal_the_cores_and_gymnasiums(env_id):
    ours, theirs = gymnasium.spec(f"walker_sim/{env_id}"), gymnasium.spec(env_id)
    for name in ("max_episode_steps", "reward_threshold", "nondeterministic", "order_enforce"):
        assert getattr(ours, name) == getattr(theirs, name), name
    core = _core.Pool(env_id, {}).specification
    assert ours.max_episode_steps == core["max_episode_steps"]
    # The core represents None as NaN.
    assert repr(float(ours.reward_threshold or "nan")) == repr(core["reward_threshold"])


@pytest.mark.parametrize("method", ["spawn", "forkserver"])
def test_the_prefix_registers_the_ids_in_a_new_process(method):
    """A new process has not imported walker_sim when Gymnasium reads the id."""
    make = functools.partial(gymnasium.make, "walker_sim:walker_sim/BipedalWalker-v3")
    envs = gymnasium.vector.AsyncVectorEnv([make], context=method)
    observations, _ = envs.reset(seed=3)
    envs.close()
    assert type(make().unwrapped) is walker_sim.WalkerEnv
    assert observations[0].tobytes() == make().reset(seed=3)[0].tobytes()


def test_public_names():
    for name in walker_sim.__all__:
        assert getattr(walker_sim, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = walker_sim.nothing


def test_an_import_needs_neither_gymnasium_nor_numpy_nor_the_extension_module(files):
    hide = "import sys; sys.modules.update(gymnasium=None, numpy=None)"
    assert last_line(f"{hide}; import walker_sim; print(walker_sim.__file__)", files) == str(
        files / "walker_sim/__init__.py"
    )


def test_an_import_loads_no_engine():
    program = "import walker_sim; print('mujoco' in open('/proc/self/maps').read(), {})"
    loaded = "walker_sim._core is not None and 'mujoco' in open('/proc/self/maps').read()"
    assert last_line(program.format(loaded), *sys.path[1:]) == "False True"


def test_the_extension_module_may_be_in_another_folder(files):
    program = f"import gymnasium, walker_sim; {MAKE}; print(walker_sim._core.__file__)"
    assert last_line(program, files, WITH_CORE) == _core.__file__


def test_without_an_extension_module(files):
    message = last_line(f"import gymnasium, walker_sim; {MAKE}", files, status=1)
    version = ".".join(map(str, sys.version_info[:2]))
    assert f"walker_sim has no extension module for this Python, {version} " in message
    assert str(files) in message
    assert "pip install" in message


def test_different_versions_are_refused_each_time(files):
    init = files / "walker_sim/__init__.py"
    init.write_text(init.read_text().replace(f'"{walker_sim.__version__}"', '"0.0.7"'))
    program = f"""
import gymnasium, walker_sim
for _ in range(2):
    try:
        {MAKE}
    except ImportError as error:
        print(error)
    else:
        print('made')
"""
    message = last_line(program, files, WITH_CORE)
    assert f"walker_sim 0.0.7 ({files}/walker_sim/" in message
    assert f"walker_sim {walker_sim.__version__} ({_core.__file__})" in message
