from .settings import MeasurementSettings as MeasurementSettings
from .specimen import index_error_covariance as index_error_covariance
from .specimen import index_errors as index_errors
from .specimen import noise_deviation as noise_deviation
from .specimen import revolution_scatter as revolution_scatter
from .specimen import tooth_cycle as tooth_cycle
