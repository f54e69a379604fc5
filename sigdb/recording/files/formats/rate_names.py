"""Names of sampling rates and sampling intervals, for headers of text and for named arrays alike."""

import re
import unicodedata


def _joined(first: str, second: str) -> set[str]:
    return {a + b for a in first.split() for b in second.split()}


RATES = frozenset(
    _joined(
        "sample samples sampling samp sam scan scans acquisition acq daq adc defaultsample abtast mess",
        "rate rates freq frequency frequenz",
    )
    | _joined("data output logging default digitizer digitiser", "rate rates")
    | _joined("sample sampling scan acquisition daq", "speed clock")
    | {
        "fs", "fsa", "fsamp", "fsample", "fsampling", "fabtast", "fmess", "sr", "sfreq", "sps", "odr",
        "samplespersecond", "samplespersec", "ratesampling", "frequencysampling", "freqsampling", "freqsample",
        "frequencysample", "rateofsampling", "rateofacquisition", "frequencyofsampling", "frequencyofacquisition",
        "samplerateofdata", "frequencedechantillonnage", "frequenceechantillonnage", "freqech", "fech",
        "tauxdechantillonnage", "frecuenciademuestreo", "frecuenciamuestreo", "frequenzadicampionamento",
        "frequenzacampionamento", "frequenciadeamostragem", "taxadeamostragem", "bemonsteringsfrequentie",
        "samplefrequentie", "samplingsfrekvens", "czestotliwoscprobkowania", "частотадискретизации", "采样率",
        "采样频率", "サンプリング周波数", "샘플링주파수",
    }
)  # fmt: skip
"""Names of a sampling rate, as :func:`plain_name` writes them."""

INTERVALS = frozenset(
    _joined(
        "time sample samples sampling samp scan x t horizontal data",
        "interval increment incr inc step period spacing delta resolution",
    )
    | _joined("abtast zeit", "intervall schritt inkrement abstand zeit")
    | {
        "dt", "δt", "ts", "tsa", "tsamp", "tsample", "tsampling", "deltat", "deltatime", "deltax", "tdelta",
        "timedelta", "stepsize", "sampletime", "samplingtime", "timepersample", "timebetweensamples", "hresolution",
        "wfincrement", "采样间隔", "采样周期",
    }
)  # fmt: skip
"""Names of a sampling interval."""


def plain_name(text: str) -> str:
    """Return the letters and digits of a name, small and without accents.

    Examples
    --------
    >>> plain_name("Sample_Rate"), plain_name("Fréquence d'échantillonnage") in RATES
    ('samplerate', True)
    """
    decomposed = unicodedata.normalize("NFKD", text[:200].lower())
    bare = "".join(sign for sign in decomposed if unicodedata.category(sign) != "Mn")
    return re.sub(r"[\W_]", "", unicodedata.normalize("NFKC", bare))
