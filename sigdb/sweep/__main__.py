"""``python -m sigdb.sweep RECIPE`` is ``sigdb sweep RECIPE``."""

from sigdb.cli.main import main
from sigdb.cli.sweep import sweep

if __name__ == "__main__":
    main(sweep, "python -m sigdb.sweep")
