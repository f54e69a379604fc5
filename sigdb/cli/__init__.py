"""The command line: a thin shell in which every command is one call of the library.

Exit codes: 0 done, 1 found something wrong, 2 bad input, 3 failed on the way, 130 interrupted.
"""

from sigdb.cli.main import main

__all__ = ["main"]
