"""The one error of the suites, in the shape of the command's own."""

RUN, INPUT = 1, 2


class BenchError(Exception):
    """`fault`: RUN, something failed; INPUT, the command line or the machine lacks something. Also the exit status."""

    def __init__(self, fault, what, where, hint):
        super().__init__(f"{what}: {where}: {hint}")
        self.fault = fault


def print_error(text, stream):
    print(f"trilume: error: {' '.join(str(text).split())}", file=stream)
