"""Files of a database: parts, receipts, seals, schema, and their integrity."""
