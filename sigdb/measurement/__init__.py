"""What a sensor, a specimen and an average add to a clean signal, as a stated random law; and what a recording holds."""

from sigdb.measurement.noise import noise_deviation, revolution_scatter
from sigdb.measurement.reading import read_recording
from sigdb.measurement.recording import Channel, Recording
from sigdb.measurement.recording_settings import RecordingSettings
from sigdb.measurement.settings import Measurement
from sigdb.measurement.specimen import index_error_covariance, index_errors, tooth_cycle

__all__ = [
    "Channel",
    "Measurement",
    "Recording",
    "RecordingSettings",
    "index_error_covariance",
    "index_errors",
    "noise_deviation",
    "read_recording",
    "revolution_scatter",
    "tooth_cycle",
]
