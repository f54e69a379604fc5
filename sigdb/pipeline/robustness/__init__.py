"""How models answer rows that do not follow their law: disturbances, rows with them, and outcomes."""
