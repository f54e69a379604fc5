"""The command ``sigdb``: its sub-commands, and the one place where errors become exit codes."""

import os
import sys

import click

from sigdb.cli.evaluate import evaluate
from sigdb.cli.modes import modes
from sigdb.cli.query import query
from sigdb.cli.show import show
from sigdb.cli.sweep import sweep
from sigdb.cli.train import train
from sigdb.core.errors import InputError, SigdbError
from sigdb.core.version import __version__

FAILED, BAD_INPUT, INTERRUPTED = 3, 2, 130


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="sigdb")
def cli() -> None:
    """Fault-signature databases for gear transmissions: make, query, learn from them."""


for _command in (modes, sweep, query, show, train, evaluate):
    cli.add_command(_command)


def main(command: click.Command = cli, name: str = "sigdb") -> None:
    """Run a command and leave with its exit code; no traceback for what a user can mend."""
    try:
        code = command.main(prog_name=name, standalone_mode=False)
        sys.exit(code if isinstance(code, int) else 0)
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except SigdbError as error:
        click.echo(f"{name}: error: {error}", err=True)
        sys.exit(BAD_INPUT if isinstance(error, InputError) else FAILED)
    except BrokenPipeError:
        # The reader (head, less) has gone; keep Python from complaining about it at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except OSError as error:
        click.echo(f"{name}: error: {error.filename or 'a file'}: {error.strerror or error}", err=True)
        sys.exit(FAILED)
    except (KeyboardInterrupt, click.Abort):
        click.echo(f"{name}: interrupted; what is finished is kept, and the same command goes on", err=True)
        sys.exit(INTERRUPTED)
