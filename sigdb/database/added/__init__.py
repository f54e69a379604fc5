"""Added features: columns that a user's function computes from stored averages."""
