"""One answer from several averages of one machine."""
