"""Errors and warnings: one line each, naming the prim."""

import contextlib
import os
import re
import sys

_DIAGNOSTIC = re.compile(r"^(?:Warning|Error|Status|Coding Error|Runtime Error|Fatal Error|Diagnostic Notification)"
                         r": in (\S+) at line \d+ of \S+ -- (.*)$")


class StageError(Exception):
    """The file cannot be shown at all: what is wrong, and what to do."""

    def __init__(self, problem, hint):
        super().__init__(problem)
        self.problem = one_line(problem)
        self.hint = hint


class Warnings:
    """Collects what is not supported or not usable; each message is handed out once, with the prims that it is about."""

    def __init__(self):
        self._pending = {}
        self._told = set()

    def __call__(self, path, message):
        if message not in self._told:
            paths = self._pending.setdefault(message, [])
            if str(path) not in paths[:1]:
                paths.append(str(path))

    def take(self):
        lines = []
        for message, paths in self._pending.items():
            more = f" (and {len(paths) - 1} more)" if len(paths) > 1 else ""
            where = f"{paths[0]}{more}: " if paths[0] else ""
            lines.append(where + one_line(message))
        self._told.update(self._pending)
        self._pending = {}
        return lines


def one_line(text):
    return " ".join(str(text).split())


def reason(error):
    """The first cause that a USD exception carries, without its C++ source positions."""
    for cause in getattr(error, "args", ()):
        if commentary := getattr(cause, "commentary", None):
            return one_line(commentary)
    return one_line(error) or type(error).__name__


def _expected(function, message):
    """Composition errors are read from the stage, with their prims; bindings without MaterialBindingAPI hold."""
    return function == "_ReportErrors" or "MaterialBindingAPI is not applied" in message


@contextlib.contextmanager
def usd_messages_to(warn):
    """USD prints diagnostics to descriptor 2 and its Python module offers no other way to receive them: while the
    block runs, take them from there. Lines that others printed are passed on."""
    sys.stderr and sys.stderr.flush()
    capture = os.memfd_create("usd-diagnostics")
    saved = os.dup(2)
    os.dup2(capture, 2)
    try:
        yield
    finally:
        sys.stderr and sys.stderr.flush()
        os.dup2(saved, 2)
        with os.fdopen(capture, "rb") as file:
            file.seek(0)
            lines = file.read().decode(errors="replace").splitlines()
        for line in lines:
            if match := _DIAGNOSTIC.match(line):
                if not _expected(match[1], match[2]):
                    warn("", match[2])
            elif line:
                os.write(saved, (line + "\n").encode())
        os.close(saved)
