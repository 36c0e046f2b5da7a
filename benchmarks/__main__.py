"""Names of benchmarks enter (all of them by default), tables of medians and ratios leave: `python -m benchmarks`."""

from __future__ import annotations

import argparse
import platform

from benchmarks import flexibility, maps, startup
from benchmarks.harness import measure, table

# name: the function that lists its cases. A new benchmark is a module beside this one and a line here.
BENCHMARKS = {"startup": startup.cases, "maps": maps.cases, "flexibility": flexibility.cases}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Print ratios to peers of the same run.")
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"which to run: {', '.join(BENCHMARKS)} (default: all)"
    )
    parser.add_argument("--rounds", type=int, default=11, help="how often each case is timed (default: 11)")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in BENCHMARKS]
    if unknown or options.rounds < 1:
        parser.error(f"there is no benchmark {unknown[0]}" if unknown else "--rounds must be at least 1")
    print(f"Python {platform.python_version()}, {platform.machine()}, {options.rounds} rounds\n")
    for name in options.names or BENCHMARKS:
        print(table(name, measure(BENCHMARKS[name](), options.rounds)), end="\n\n")


if __name__ == "__main__":
    main()
