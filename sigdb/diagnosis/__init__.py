"""The diagnosis of a recording: is a gear damaged, at which tooth, and how severely."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "Detector",
    "Diagnosis",
    "Finding",
    "HealthyLaw",
    "JointDiagnosis",
    "JointPart",
    "JointPosterior",
    "LevelChange",
    "Location",
    "Power",
    "StoredReference",
    "diagnose",
    "diagnose_jointly",
    "joint_answer",
]
