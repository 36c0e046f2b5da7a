"""pyproject.toml enters, requirements/constraints.txt leaves: the exact versions a fresh environment gets today.

A new environment is made in a temporary folder with every extra, without the old pins; what pip put there is written.
"""

from __future__ import annotations

import platform
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PINS = ROOT / "requirements" / "constraints.txt"
EXTRAS = "dev,parquet,storm,bench"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        pip = [str(Path(folder) / "bin" / "python"), "-m", "pip", "--disable-pip-version-check"]
        subprocess.run([*pip, "install", "-q", f"{ROOT}[{EXTRAS}]"], check=True)
        freeze = [*pip, "freeze", "--exclude", "ratherthan", "--exclude", "setuptools", "--exclude", "pip"]
        frozen = subprocess.run(freeze, check=True, capture_output=True, text=True).stdout
    head = (
        f"# Written by `make lock` with Python {platform.python_version()}: what the checks run with.\n"
        "# pyproject.toml holds the ranges that the package promises.\n"
    )
    PINS.write_text(head + frozen, encoding="utf-8")
    sys.stdout.write(f"{PINS.relative_to(ROOT)}: {len(frozen.splitlines())} pins\n")


if __name__ == "__main__":
    main()
