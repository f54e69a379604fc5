"""``python -m sigdb`` is ``sigdb``."""

from sigdb.cli import main

if __name__ == "__main__":
    main()
