"""The Bayes bound, and models compared with it."""
