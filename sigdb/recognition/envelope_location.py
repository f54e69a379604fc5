"""The baseline of the envelope's peak: the tooth in whose pass the residual is greatest."""

import numpy as np
import pandas as pd
from scipy.signal import hilbert

from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.averages_by_length import averages_by_teeth
from sigdb.recognition.streamed import reduced
from sigdb.recognition.threshold_location import ThresholdLocation
from sigdb.signature import residual_signal


class EnvelopePeak:
    """Averages to the crest of the envelope of their residual, and the tooth in whose pass it is."""

    column = "envelope_peak"

    def transform(self, X: pd.DataFrame) -> FloatArray:
        """(rows, 2) of rows with ``teeth`` and ``tsa``: greatest modulus of the analytic residual over its root mean
        square, no unit; tooth, numbered from 1."""
        found = np.empty((len(X), 2))
        for teeth, at, x in averages_by_teeth(X):
            envelope = np.abs(hilbert(residual_signal(x, teeth=teeth)))
            peak = envelope.argmax(axis=1)
            rms = np.sqrt((envelope**2).mean(axis=1)).clip(min=np.finfo(float).tiny)
            found[at] = np.column_stack([envelope.max(axis=1) / rms, 1 + peak * teeth // x.shape[1]])
        return found


class EnvelopeLocation(ThresholdLocation):
    """The tooth whose pass holds the peak of the residual's envelope; none where the peak is no higher than usual.

    The peak is measured in root mean squares of the envelope, and the threshold is what a set share of the healthy
    training rows exceeds. A peak comes at or after the first damaged tooth, so that neighbouring damaged teeth are
    often taken for one another.
    """

    reducer = EnvelopePeak()

    def indicator(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) peak over root mean square, no unit."""
        return reduced(self.reducer, X)[:, 0]

    def tooth(self, X: pd.DataFrame) -> IntArray:
        """(rows,) tooth in whose pass the peak is."""
        return reduced(self.reducer, X)[:, 1].astype(int)
