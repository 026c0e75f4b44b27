"""Mean of the latest networks, which is steadier than the last one alone."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Average:
    """Mean of the actors after the latest `count` updates."""

    def __init__(self, count: int) -> None:
        self._networks: deque[list[NDArray[np.float32]]] = deque(maxlen=count)

    def add(self, arrays: list[NDArray[np.float32]]) -> None:
        """Adds a network, and drops the oldest if there are more than `count`."""
        self._networks.append(arrays)

    def mean(self) -> list[NDArray[np.float32]]:
        """Returns the mean weight and bias of each layer in turn."""
        means: list[NDArray[np.float32]] = []
        for arrays in zip(*self._networks):
            mean: NDArray[np.float64] = np.mean(np.stack(arrays), axis=0, dtype=np.float64)
            means.append(mean.astype(np.float32))
        return means

    def save(self, path: Path) -> None:
        """Writes all networks to a .npz file."""
        arrays: dict[str, Any] = {
            f"{age}.{index}": array
            for age, network in enumerate(self._networks)
            for index, array in enumerate(network)
        }
        np.savez(path, **arrays)

    def load(self, path: Path) -> None:
        with np.load(path) as file:
            ages = 1 + max(int(name.partition(".")[0]) for name in file.files)
            size = len(file.files) // ages
            for age in range(ages):
                self._networks.append([file[f"{age}.{index}"] for index in range(size)])
