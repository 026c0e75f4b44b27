"""Resource usage of a process over time, and checks that it stays constant."""

import os
import pathlib
import time

import numpy as np

PAGE = os.sysconf("SC_PAGE_SIZE")
MIB = 1 << 20
MAX_GROWTH = 2 * MIB  # [bytes] by a linear fit over the second half of a part
MIN_CALLS = 1000  # minimum calls per compared fifth of a part
MIN_DURATION = 60.0  # minimum duration [s] to judge memory and latency, after the warm-up


def now(pid):
    """Returns the resident bytes, and the numbers of file descriptors and threads."""
    pages = int(pathlib.Path(f"/proc/{pid}/statm").read_text().split()[1])
    files = len(os.listdir(f"/proc/{pid}/fd"))
    return pages * PAGE, files, len(os.listdir(f"/proc/{pid}/task"))


class Usage:
    """Samples of a process, at most five per second however often `sample` is called."""

    def __init__(self, pid):
        self._pid, self._samples, self._last = pid, [], 0.0
        self.before = now(pid)

    def sample(self):
        at = time.monotonic()
        if at - self._last > 0.2:
            self._samples.append((at, *now(self._pid)))
            self._last = at

    def is_long_enough(self):
        """Whether the samples cover enough time for a meaningful `growth`."""
        return bool(self._samples) and self._samples[-1][0] - self._samples[0][0] >= MIN_DURATION

    def growth(self):
        half = np.array(self._samples[len(self._samples) // 2 :], float)
        times = half[:, 0] - half[0, 0]
        slope = np.polyfit(times, half[:, 1], 1)[0]
        return float(slope * times[-1])

    def check(self, tally, whose, work="", limit=MAX_GROWTH):
        """Checks that memory grows by less than `limit` bytes, if the samples cover enough time. If
        `work` describes the load, also reports figures."""
        if not self.is_long_enough():
            if work:
                tally.figure(f"memory of {whose}, {work}", "too short to tell")
            return
        growth = self.growth()
        resident = self._samples[-1][1] / MIB
        tally.check(
            f"memory of {whose} is flat",
            growth < limit,
            f"+{growth / MIB:.2f} MiB in the second half, at {resident:.1f} MiB",
        )
        if work:
            tally.figure(
                f"memory of {whose}, {work}",
                f"{resident:.1f} MiB, {growth / MIB:+.2f} MiB in the second half",
            )

    def check_handles(self, tally, whose):
        """Checks that there are again as many descriptors and threads as at the construction."""

        def settled():
            return now(self._pid)[1:] == self.before[1:]

        end = time.monotonic() + 10
        while not settled() and time.monotonic() < end:
            time.sleep(0.05)
        tally.check(
            f"descriptors and threads of {whose} are as many as before",
            settled(),
            f"{now(self._pid)[1:]}; before {self.before[1:]}",
        )


class Latency:
    def __init__(self):
        self._begun, self._times = time.monotonic(), []

    def __enter__(self):
        self._from = time.perf_counter()
        return self

    def __exit__(self, *_):
        self._times.append(time.perf_counter() - self._from)

    def check(self, tally, what, is_alone=True):
        """Compares the first fifth with the last, if both are long enough. If other parts load the
        processors (`is_alone` is false), only reports both."""
        fifth = len(self._times) // 5
        if fifth < MIN_CALLS or time.monotonic() - self._begun < MIN_DURATION:
            return
        first, last = (
            np.percentile(np.array(part) * 1e6, [25, 50, 99])
            for part in (self._times[:fifth], self._times[-fifth:])
        )
        # A growing cost slows every call; other load on the machine slows only some.
        if is_alone:
            tally.check(
                f"the 25th percentile of {what} stays below twice the first",
                last[0] < 2 * first[0],
                f"{first} us at first, {last} us at last",
            )
        tally.figure(
            f"{what}: 25th, 50th, 99th percentile at first; at last [us]",
            "; ".join(", ".join(f"{value:.0f}" for value in part) for part in (first, last)),
        )
