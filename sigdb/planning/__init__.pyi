from .measurement_plan import MeasurementPlan as MeasurementPlan
from .plan import plan_measurement as plan_measurement
from .settings import PlanSettings as PlanSettings
