"""``python -m ratherthan`` enters, the command line answers."""

from ratherthan.apps.cli import run

if __name__ == "__main__":
    run()
