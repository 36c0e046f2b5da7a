"""Names of benchmarks enter (all of them by default), tables of medians and ratios leave: `python -m benchmarks`."""

from __future__ import annotations

import argparse
import platform

from benchmarks.harness import measure, table

# A new benchmark is a module beside this one, with a function `cases`, and a word here.
BENCHMARKS = (
    "startup",
    "maps",
    "large_maps",
    "generic",
    "traps",
    "discounted",
    "flexibility",
    "questions",
    "cluster",
    "growth",
    "study",
)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Print ratios to peers of the same run.")
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"which to run: {', '.join(BENCHMARKS)} (default: all)"
    )
    parser.add_argument("--rounds", type=int, default=3, help="how often each case is timed (default: 3)")
    parser.add_argument("--most", type=float, default=120.0, help="seconds that one run may take (default: 120)")
    parser.add_argument("--plot", metavar="FILE.svg", help="draw the benchmark 'growth'")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in BENCHMARKS]
    if unknown or options.rounds < 1:
        parser.error(f"there is no benchmark {unknown[0]}" if unknown else "--rounds must be at least 1")
    print(f"Python {platform.python_version()}, {platform.machine()}, {options.rounds} rounds at most\n")
    for name in options.names or BENCHMARKS:
        measured = measure(f"benchmarks.{name}", options.rounds, options.most)
        print(table(name.replace("_", " "), measured), end="\n\n", flush=True)
        if name == "growth" and options.plot:
            from benchmarks.growth import plot

            plot(measured, options.plot)


if __name__ == "__main__":
    main()
