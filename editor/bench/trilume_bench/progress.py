"""A bar with the time left, on standard error."""

import shutil
import sys
import time


class Progress:
    """mode: auto (on a terminal), on, off. `weights`: expected seconds of each step, in any unit."""

    def __init__(self, mode, weights):
        self.shown = mode == "on" or (mode == "auto" and sys.stderr.isatty())
        self.weights, self.done, self.spent, self.measured = list(weights), 0, 0.0, 0.0

    def show(self, name):
        if not self.shown:
            return
        whole, done = sum(self.weights), sum(self.weights[:self.done])
        left = duration(self.spent / self.measured * (whole - done)) if self.measured else "?"
        width = max(20, shutil.get_terminal_size((80, 24)).columns - 1)
        text = f" {self.done}/{len(self.weights)}, {left} left: {name}"
        cells = max(8, min(30, width - len(text) - 2))
        full = round(cells * done / whole) if whole else cells
        sys.stderr.write(f"\r\033[K[{'#' * full}{'-' * (cells - full)}]{text}"[:width + 4])
        sys.stderr.flush()

    def step(self, seconds):
        """The next step is done; `seconds` None: it was known already, which tells nothing about the rest."""
        if seconds is not None:
            self.spent += seconds
            self.measured += self.weights[self.done]
        self.done += 1

    def close(self):
        if self.shown:
            sys.stderr.write("\r\033[K")
            sys.stderr.flush()


class Watch:
    def __init__(self):
        self.begun = time.monotonic()

    def seconds(self):
        return time.monotonic() - self.begun


def duration(seconds):
    """1:05:09, 4:30 or 12 s."""
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    minutes, seconds = divmod(seconds, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{seconds:02d}" if hours else f"{minutes}:{seconds:02d}"
