"""Planning of measurements: which sensor, operating point and number of averages would show which damage."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "MeasurementPlan",
    "PlanSettings",
    "plan_measurement",
]
