"""Results of a soak: checks by name, figures, and the report."""

import collections

MAX_PRINTED = 5  # failures per check


class Tally:
    """Collects results. All checks of one name make one line, which fails if one of them does."""

    def __init__(self, say):
        self._say = say
        self.part = ""
        self.counts = collections.defaultdict(int)  # by part and check
        self.failures = collections.defaultdict(list)
        self.figures = []  # part, name, value
        self.left_out = []  # part, reason

    def check(self, name, is_met, message=""):
        self.counts[self.part, name] += 1
        if not is_met:
            messages = self.failures[self.part, name]
            messages.append(str(message))
            if len(messages) <= MAX_PRINTED:
                self._say(f"  FAILED {self.part}: {name}: {message}")
        return is_met

    def figure(self, name, value):
        self.figures.append((self.part, name, value))

    def leave_out(self, reason):
        self.left_out.append((self.part, reason))
        self._say(f"  left out: {reason}")

    @property
    def failed(self):
        return sum(bool(messages) for messages in self.failures.values())

    def found(self):
        """Returns all results, for `add` in another process."""
        return dict(self.counts), dict(self.failures), self.figures, self.left_out

    def add(self, found):
        counts, failures, figures, left_out = found
        self.counts.update(counts)
        self.failures.update(failures)
        self.figures += figures
        self.left_out += left_out

    def summary(self):
        text = f"{len(self.counts) - self.failed} passed, {self.failed} failed"
        return text + (f", {len(self.left_out)} left out" if self.left_out else "")


def markdown(tally, head):
    """Returns the report, which names neither paths nor the host.

    Parameters
    ----------
    head
        Names and values of the run.
    """
    lines = ["# Soak", "", "| run | |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in head.items()]
    lines += ["", "| figure | | |", "|---|---|---|"]
    lines += [f"| {part} | {name} | {value} |" for part, name, value in tally.figures]
    lines += ["", "| part | check | made | failed |", "|---|---|---|---|"]
    for (part, name), count in tally.counts.items():
        lines.append(f"| {part} | {name} | {count} | {len(tally.failures.get((part, name), []))} |")
    for (part, name), messages in tally.failures.items():
        if messages:
            lines += ["", f"Failed: {part}: {name}", "", "```", *messages[:MAX_PRINTED], "```"]
    if tally.left_out:
        lines += ["", "Left out:", ""]
        lines += [f"- {part}: {reason}" for part, reason in tally.left_out]
    return "\n".join([*lines, "", tally.summary(), ""])
