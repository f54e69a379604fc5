"""Types and functions that all packages use: fields, errors, answers, notes, progress, streams, arrays, kernels."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "ANSWERS",
    "Answer",
    "AnswerForm",
    "Note",
    "Progress",
]
