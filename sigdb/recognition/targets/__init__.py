"""Targets: the questions that a model answers, each as an object."""
