"""Virtual rows: rows that are made from the stored templates when they are read."""
