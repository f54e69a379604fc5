"""Disturbances of a real recording besides the steady vibration of the mesh, a field for each."""

from sigdb.core import Section, quantity
from sigdb.recording.synthetic.noise import Noise
from sigdb.recording.synthetic.operation import Drift
from sigdb.recording.synthetic.sensor_resonance import SensorResonance
from sigdb.recording.synthetic.tacho import Tacho
from sigdb.recording.synthetic.tones import BearingTones, ShaftTones


class Surroundings(Section):
    """Disturbances of a recording; by default there are none, and the tacho gives one exact pulse per revolution.

    Mesh, tones and bearings pass the sensor's path; noise is added behind it. Backlash and loss of contact need no
    switch: the march in time always includes them.

    Examples
    --------
    >>> surroundings = Surroundings(noise=Noise(snr_db=-25.0), speed=Drift(depth=0.01, period=0.5))
    >>> surroundings.path is None
    True
    """

    speed: Drift | None = quantity("-", "Speed relative to the operating point; constant if left out.", default=None)
    torque: Drift | None = quantity("-", "Torque relative to the operating point; constant if left out.", default=None)
    shafts: tuple[ShaftTones, ...] = quantity("-", "Tones of other shafts.", default=())
    bearings: tuple[BearingTones, ...] = quantity("-", "Tones of damaged bearings.", default=())
    path: SensorResonance | None = quantity("-", "Path to the sensor; direct if left out.", default=None)
    noise: Noise | None = quantity("-", "Noise of the recording; none if left out.", default=None)
    tacho: Tacho = quantity("-", "The tacho.", default=Tacho())
