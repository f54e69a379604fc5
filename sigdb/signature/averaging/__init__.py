"""Time-synchronous averaging, with and without a tacho."""
