"""Metrics of answers, with confidence intervals over specimens."""
