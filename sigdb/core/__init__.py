"""What every layer shares: parameter fields, errors, random streams, array types."""
