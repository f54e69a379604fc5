"""Recordings: files, the shaft angle, the signature of a gear, and synthetic recordings."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "AveragingSettings",
    "Channel",
    "EnvelopeSpectrum",
    "MeshPresence",
    "NoMeshError",
    "OrderMap",
    "RecordedAverages",
    "RecordedSignature",
    "Recording",
    "RecordingBlocks",
    "RecordingSettings",
    "Repeatability",
    "SharedChannels",
    "Surroundings",
    "read_in_blocks",
    "read_recording",
    "recorded_averages",
    "recorded_history",
    "recorded_signature",
    "recording_from",
    "synthetic_recording",
]
