"""All that a real recording has beside the steady vibration of the mesh, each switched on by its own field."""

from sigdb.core import Section, quantity
from sigdb.recording.synthetic.noise import Noise
from sigdb.recording.synthetic.operation import Drift
from sigdb.recording.synthetic.sensor_resonance import SensorResonance
from sigdb.recording.synthetic.tacho import Tacho
from sigdb.recording.synthetic.tones import BearingTones, ShaftTones


class Surroundings(Section):
    """What disturbs a recording; by default nothing does, and the tacho gives one exact pulse a revolution.

    Mesh, tones and bearings pass the sensor's path; noise comes behind it. Backlash and loss of contact need no switch:
    the march in time has them always.

    Examples
    --------
    >>> surroundings = Surroundings(noise=Noise(snr_db=-25.0), speed=Drift(depth=0.01, period=0.5))
    >>> surroundings.path is None
    True
    """

    speed: Drift | None = quantity("-", "Speed against the operating point's; held if left out.", default=None)
    torque: Drift | None = quantity("-", "Torque against the operating point's; held if left out.", default=None)
    shafts: tuple[ShaftTones, ...] = quantity("-", "Tones of other shafts.", default=())
    bearings: tuple[BearingTones, ...] = quantity("-", "Tones of damaged bearings.", default=())
    path: SensorResonance | None = quantity("-", "Path to the sensor; direct if left out.", default=None)
    noise: Noise | None = quantity("-", "Noise of the recording; none if left out.", default=None)
    tacho: Tacho = quantity("-", "The tacho.", default=Tacho())
