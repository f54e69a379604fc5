"""Facts of recordings that no file states: tables, patterns over names, and names of damage."""
