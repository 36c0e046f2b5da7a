"""One command a file: it parses, calls, prints. `ratherthan.apps.cli` loads the one that is asked for."""
