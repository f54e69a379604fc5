"""``python -m sigdb.sweep RECIPE`` is ``sigdb sweep RECIPE``."""

from sigdb.cli import main
from sigdb.cli.commands.sweep import sweep

if __name__ == "__main__":
    main(sweep, "python -m sigdb.sweep")
