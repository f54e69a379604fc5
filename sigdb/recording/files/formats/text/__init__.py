"""Tables of numbers in text, plain or gzipped."""
