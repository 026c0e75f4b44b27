"""For catkin, which makes one package of these files and the messages. pip reads pyproject.toml."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import find_packages, setup

setup(
    **generate_distutils_setup(
        packages=find_packages("src/python"),
        package_dir={"": "src/python"},
        package_data={"walker_sim": ["*.pyi", "py.typed"]},
    )
)
