"""Lends the suites beside it what the walkers' own suites and the recordings know of Gymnasium."""

import pathlib
import sys

TEST = pathlib.Path(__file__).resolve().parents[1]
sys.path += [str(TEST / folder) for folder in ("bipedal_walker", "recordings", "walker2d")]
