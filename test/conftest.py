"""Puts this folder and the folders of the other shared helper modules on sys.path."""

import pathlib
import sys

TEST = pathlib.Path(__file__).resolve().parent
FOLDERS = (
    "bench",
    "promises",
    "python",
    "robots/bipedal_walker",
    "robots/mujoco",
    "recordings",
    "server",
)
sys.path += [str(TEST / folder) for folder in FOLDERS]
