"""The command ``sigdb``: its sub-commands, and the one place where errors become exit codes."""

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import click

from sigdb.cli.commands.card import card
from sigdb.cli.commands.coverage import coverage
from sigdb.cli.commands.describe import describe
from sigdb.cli.commands.diagnose import diagnose
from sigdb.cli.commands.evaluate import evaluate
from sigdb.cli.commands.export import export
from sigdb.cli.commands.match import match
from sigdb.cli.commands.modes import modes
from sigdb.cli.commands.new_rig import new_rig
from sigdb.cli.commands.query import query
from sigdb.cli.commands.refine import refine
from sigdb.cli.commands.run import run
from sigdb.cli.commands.show import show
from sigdb.cli.commands.signature import signature
from sigdb.cli.commands.sweep import sweep
from sigdb.cli.commands.train import train
from sigdb.cli.commands.verify import verify
from sigdb.core import InputError, SigdbError, __version__

FAILED, BAD_INPUT, INTERRUPTED = 3, 2, 130


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="sigdb")
def cli() -> None:
    """Fault-signature databases for gear transmissions: make, query, learn from them."""


for _command in (
    new_rig,
    describe,
    modes,
    run,
    sweep,
    verify,
    coverage,
    refine,
    card,
    query,
    show,
    match,
    signature,
    export,
    train,
    evaluate,
    diagnose,
):
    cli.add_command(_command)


def main(command: click.Command = cli, name: str = "sigdb") -> None:
    """Run a command and leave with its exit code; no traceback for what a user can mend."""
    stdout = sys.stdout
    try:
        with _log_on_stderr():
            code = _run(command, name)
        sys.stdout.flush()
    except SystemExit as left:
        # click leaves by itself, with another stdout, when the reader (head, less) has gone.
        code = 0 if sys.stdout is not stdout else int(left.code or 0)
    except BrokenPipeError:
        # Keep Python from complaining about the reader that has gone when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), stdout.fileno())
        code = 0
    sys.exit(code)


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
    """Exit code of a command; what a user can mend is told in a sentence."""
    try:
        code = command.main(prog_name=name, standalone_mode=False)
        return code if isinstance(code, int) else 0
    except click.ClickException as error:
        error.show()
        return BAD_INPUT
    except SigdbError as error:
        click.echo(f"{name}: error: {error}", err=True)
        return BAD_INPUT if isinstance(error, InputError) else FAILED
    except BrokenPipeError:
        raise
    except OSError as error:
        click.echo(f"{name}: error: {error.filename or 'a file'}: {error.strerror or error}", err=True)
        return FAILED
    except (KeyboardInterrupt, click.Abort):
        click.echo(f"{name}: interrupted; what is finished is kept, and the same command goes on", err=True)
        return INTERRUPTED
