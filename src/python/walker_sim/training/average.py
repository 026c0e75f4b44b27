"""The mean of the last networks: steadier than the last one alone."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Average:
    """Of the actor after the last `count` updates."""

    def __init__(self, count: int) -> None:
        self._networks: deque[list[NDArray[np.float32]]] = deque(maxlen=count)

    def add(self, arrays: list[NDArray[np.float32]]) -> None:
        """Takes the newest; the oldest goes."""
        self._networks.append(arrays)

    def mean(self) -> list[NDArray[np.float32]]:
        """Weight and bias of each layer in turn."""
        means: list[NDArray[np.float32]] = []
        for arrays in zip(*self._networks):
            mean: NDArray[np.float64] = np.mean(np.stack(arrays), axis=0, dtype=np.float64)
            means.append(mean.astype(np.float32))
        return means

    def save(self, path: Path) -> None:
        """All that it remembers."""
        arrays: dict[str, Any] = {
            f"{age}.{index}": array
            for age, network in enumerate(self._networks)
            for index, array in enumerate(network)
        }
        np.savez(path, **arrays)

    def load(self, path: Path) -> None:
        """What `save` has written."""
        with np.load(path) as file:
            ages = 1 + max(int(name.partition(".")[0]) for name in file.files)
            size = len(file.files) // ages
            for age in range(ages):
                self._networks.append([file[f"{age}.{index}"] for index in range(size)])
