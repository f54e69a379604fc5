"""Options, side files and arguments of the command at random: right values, and absurd ones of every type."""

import datetime
import json

from sigdb.recording import AveragingSettings, RecordingSettings

RIGHT = {
    "sampling_rate": (2000.0, 12_800.0, 1.0), "names": (["t", "a", "b", "c"], ["a"]),
    "channels": (["a1"], ["a2", "a1"]), "units": ("g", {"a1": "m/s^2"}), "scale": (2.0, {"a1": -1.0}),
    "time": ("time", False), "file_format": ("csv", "mat"), "variable": ("run", "a1"),
    "separator": (",", ";", "\t", " "), "decimal": (".", ","), "longest_gap": (0, 5), "tacho": ("tacho", "a2"),
    "pulses_per_rev": (1.0, 60.0), "threshold": (2.5,), "hysteresis": (0.5,),
    "tacho_kind": ("waveform", "pulse-times", "counts", "angle", "speed"), "edge": ("rising", "falling"),
    "ratio": ("19/48", 0.5), "teeth": (8, 24), "speed_rpm": (1500.0,), "torque": (20.0,), "channel": ("a1",),
    "gear": ("pinion",), "mesh_phase": (True,), "harmonic": (1, 2), "speed_range_rpm": ((300.0, 6000.0),),
    "samples_per_tooth": (16, 64), "revolutions": (1, 4),
}  # fmt: skip


def _nested(depth):
    value = 1
    for _ in range(depth):
        value = [value]
    return value


ABSURD = (
    True, False, 0, 1, -1, 2**31, 2**63, 10**30, 10**400, 0.0, -0.0, 1e-300, 1e300, 1e308, float("inf"), float("-inf"),
    float("nan"), "", " ", "nan", "1/0", "0/1", "1e400", "1/1e-320", "19/48/2", "a1", "time", "x" * 5000, "\x1b[31mred",
    "a\nb", "\x00", "../../etc", "é" * 40, [], [""], ["a1", "a1"], ["x"] * 2000, [1, 2], [[]], {}, {"a1": 1}, {"": ""},
    {"a1": float("nan")}, {"\x1b[2J": "g"}, {"a1": {"b": 2}}, _nested(40), datetime.date(2024, 1, 2),
    datetime.datetime(2024, 1, 2, tzinfo=datetime.UTC),
)  # fmt: skip

READING = tuple(RecordingSettings.model_fields)
AVERAGING = tuple(AveragingSettings.model_fields)


def drawn_options(random, fields=READING, *, absurd=0.5):
    """Up to four options by name."""
    options = {}
    for _ in range(int(random.integers(1, 5))):
        name = fields[int(random.integers(len(fields)))]
        values = ABSURD if random.random() < absurd or name not in RIGHT else RIGHT[name]
        options[name] = values[int(random.integers(len(values)))]
    return options


def side_file(random):
    """The bytes of a side file, sometimes damaged or no TOML at all."""
    options = drawn_options(random)
    text = "\n".join(f"{key} = {_toml(value)}" for key, value in options.items()) + "\n"
    match int(random.integers(12)):
        case 0:
            text += "sampling_rat = 2000\n"
        case 1:
            text += "a = " + "[" * 3000 + "]" * 3000
        case 2:
            text += ".".join("k" * 300) + " = 1"
        case 3:
            text += '"\\u001b[31m" = 1\n"\\u0000" = 2\n'
        case 4:
            text += text
        case 5:
            return random.bytes(300)
        case 6:
            return text.encode("utf-16")
        case 7:
            at = int(random.integers(len(text)))
            text = text[:at] + chr(int(random.integers(1, 0x2100))) + text[at + 1 :]
        case 8:
            text += "[units]\na1 = 'g'\n[scale]\na1 = " + "9" * 5000
    return text.encode("utf-8", "surrogatepass")


def _toml(value):
    match value:
        case bool():
            return str(value).lower()
        case int() | float():
            return str(value)
        case str():
            return json.dumps(value)
        case dict():
            return "{" + ", ".join(f"{json.dumps(key)} = {_toml(part)}" for key, part in value.items()) + "}"
        case list() | tuple():
            return "[" + ", ".join(map(_toml, value)) + "]"
    return value.isoformat()


def arguments(random):
    """Arguments of ``sigdb signature``."""
    words = []
    for name, value in drawn_options(random, (*READING, *AVERAGING), absurd=0.3).items():
        if isinstance(value, str | int | float) and not isinstance(value, bool):
            words += [f"--{name.replace('_', '-')}", str(value).replace("\0", "?")]
    if random.random() < 0.6:
        words += ["--teeth", "8"]
    if random.random() < 0.5 and "--tacho" not in words:
        words += ["--tacho", "tacho"] if random.random() < 0.6 else ["--mesh-phase"]
    return words
