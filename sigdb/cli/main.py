"""The command ``sigdb``: its sub-commands, and the one place where errors become exit codes."""

import importlib
import io
import logging
import os
import pkgutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum
from pathlib import Path

import click

from sigdb.cli import commands
from sigdb.cli.output import discard_output, visible_output
from sigdb.core import InputError, SigdbError, __version__, visible_text

_ORDER = (
    "explore",
    *("new-rig", "describe", "modes", "identify", "plan-measurement"),
    *("run", "sweep", "ingest", "label", "verify", "coverage", "refine", "add-features", "card"),
    *("query", "show", "match", "export"),
    *("signature", "diagnose", "monitor"),
    *("train", "evaluate", "assess", "fuse", "public-sets"),
)
"""Order of the commands in the help; others follow by name."""


class ExitCode(IntEnum):
    """Exit codes of the commands."""

    DONE = 0
    WRONG = 1
    """The command did its work and found something wrong: damage, a match not reached, a model above the bound."""
    BAD_INPUT = 2
    FAILED = 3
    INTERRUPTED = 130


class Commands(click.Group):
    """The modules of :mod:`sigdb.cli.commands`; a module is imported when its command is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands, in the order of the help."""
        names = [module.name.replace("_", "-") for module in pkgutil.iter_modules(commands.__path__)]
        return sorted(names, key=lambda name: (_ORDER.index(name) if name in _ORDER else len(_ORDER), name))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of a name; None if there is none."""
        if cmd_name not in self.list_commands(ctx):
            return None
        stem = cmd_name.replace("-", "_")
        command: click.Command = getattr(importlib.import_module(f"{commands.__name__}.{stem}"), stem)
        return command


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="sigdb")
def cli() -> None:
    """Fault-signature databases for gear transmissions: make them, query them, learn from them."""


def main(command: click.Command = cli, name: str = "sigdb") -> None:
    """Run a command and exit with its code; errors of a user's input show a sentence instead of a traceback.

    Parameters
    ----------
    command : click.Command
        The command; by default the group of all of them.
    name : str
        Name of the program in messages.
    """
    # Read when a library of linear algebra is loaded, here and in the workers; all matrices are small.
    for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(variable, "1")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # not every terminal and pipe has every letter
    with visible_output():
        code = _exit_code(command, name)
    sys.exit(code)


def _exit_code(command: click.Command, name: str) -> int:
    stdout = sys.stdout
    if stdout is None:
        _complain(name, "the standard output is closed; give it a place, such as a file or /dev/null")
        return ExitCode.FAILED
    try:
        with _log_on_stderr():
            return _run(command, name)
    except SystemExit as left:
        # click leaves by itself, with another stdout, when the reader (head, less) has gone.
        if sys.stdout is stdout:
            return int(left.code or 0)
        discard_output()
        return ExitCode.DONE
    except BrokenPipeError:
        discard_output()
        return ExitCode.DONE


@contextmanager
def _log_on_stderr() -> Iterator[None]:
    """Write what the library logs to stderr. The library itself configures no logging."""
    handler, logger = logging.StreamHandler(), logging.getLogger("sigdb")
    handler.setFormatter(logging.Formatter("sigdb: %(message)s"))
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)


def _run(command: click.Command, name: str) -> int:
    """Return the exit code of a command, and print a sentence about what a user can mend."""
    try:
        code = command.main(prog_name=name, standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else ExitCode.DONE
    except click.ClickException as error:
        error.show()
        return ExitCode.BAD_INPUT
    except SigdbError as error:
        _complain(name, str(error))
        return ExitCode.BAD_INPUT if isinstance(error, InputError) else ExitCode.FAILED
    except UnicodeEncodeError as error:
        _complain(name, f"{error.object}: character {error.start + 1} is no text in UTF-8; give it another name")
        return ExitCode.BAD_INPUT
    except BrokenPipeError:
        raise
    except OSError as error:
        _complain(name, f"{error.filename or _place()}: {error.strerror or error}")
        with suppress(OSError):
            discard_output()
        return ExitCode.FAILED
    except (KeyboardInterrupt, click.Abort):
        click.echo(f"{name}: interrupted; what is finished is kept, and the same command goes on", err=True)
        return ExitCode.INTERRUPTED


def _place() -> str:
    """Return the place of an error that names no file."""
    try:
        return "the output" if Path.cwd() else ""
    except OSError:
        return "the working directory, which was deleted or cannot be read"


def _complain(name: str, text: str) -> None:
    """Print an error on one line; each of several problems has its own."""
    for problem in text.split("\n"):
        click.echo(f"{name}: error: {visible_text(problem, lines=False)}", err=True)
