"""Nothing enters; the archive of kernels that travels with the package leaves, made anew: `python tools/ship_kernels.py`.

Every kernel that the tasks of ``ratherthan warmup`` need is turned into LLVM's text, for a processor that has nothing special.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ["NUMBA_CPU_NAME"] = "generic"
os.environ["NUMBA_CPU_FEATURES"] = ""
os.environ.pop("NUMBA_DISABLE_JIT", None)


def main() -> None:
    from ratherthan.apps.warming import warmed
    from ratherthan.model.compiling import tally
    from ratherthan.model.compiling.shipped import pack

    tally.texts = {}
    warmed(lambda task: print(f"{task} …", file=sys.stderr))
    path: Path = pack(tally.texts)
    alone = f"; left to numba: {', '.join(tally.plain)}" if tally.plain else ""
    print(f"{path}: {len(tally.texts)} kernels, {path.stat().st_size} bytes{alone}")


if __name__ == "__main__":
    main()
