"""``python -m ratherthan`` and the command ``ratherthan`` enter, the command line answers."""

import _signal  # type: ignore[import-not-found]  # signal loads more, and meanwhile nobody would hear Ctrl-C
import os

__all__ = ["run"]


def run() -> None:
    """Run the command line; whoever ends it while it is being loaded is heard, too."""
    for number in (_signal.SIGINT, _signal.SIGTERM):
        _signal.signal(number, lambda heard, _: os._exit(128 + heard))
    from ratherthan.apps import cli

    cli.run()


if __name__ == "__main__":
    run()
