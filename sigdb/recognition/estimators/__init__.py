"""Estimators of location and severity, and detectors."""
