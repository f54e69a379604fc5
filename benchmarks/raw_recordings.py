"""What models of a periodic database lose on raw recordings, by cause.

A database of `pipelines/quick.toml`, at a level of noise where the best rule is often wrong, trains templates, LDA and
boosting. They are asked about averages of raw recordings of the same rig: marched in time with backlash, sampled by a
sensor and a tacho, cut at the tacho's pulses and averaged, as a measurement would be. The cases are those of the
database in the same shares, the gears are new ones. One ingredient is switched on at a time, then many together.
Noise has the same density as in the database, and is drawn alike in all lines, so that lines differ by their cause.

A loss in decibels says by how much the database's noise may grow until the Bayes rule errs as often. `loss` is against
that rule without any ingredient, `cause` is that less the loss of the line without any. Intervals are of 95 %, by a
bootstrap over cases, each of which has gears of its own.

    python benchmarks/raw_recordings.py [--json | --markdown] [--cases N] [--repeats N] [--snr-db X]
"""

import argparse
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from measuring import environment, json_option, publish, timed
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.core.streams import specimen_stream
from sigdb.database import Database
from sigdb.dynamics import PeriodicRig, prepare_periodic
from sigdb.measurement import index_errors
from sigdb.pipeline import load_recipe
from sigdb.recognition import ErrorCurve, OperatingPoint, above_bound, error_curve, operating_points, train
from sigdb.recording import Surroundings
from sigdb.recording.synthetic.motion import Motion, simulate_motion
from sigdb.recording.synthetic.recording import record
from sigdb.recording.synthetic.sensors import relative_density
from sigdb.signature import difference_signal, fm4, mesh_bands, pooled_wigner_ville, synchronous_average, tacho_pulses
from sigdb.sweep import run
from sigdb.transmission import Transmission

RECIPE = Path(__file__).parents[1] / "pipelines" / "quick.toml"
SNR_DB, CASES, REPEATS = -22.0, 240, 3
RATE, LOW_RATE = 204.8e3, 51.2e3
STEPS_PER_TOOTH = 128
"""The march is right to 1e-4 of the peak-to-peak then."""
SPECIMENS, NOISE = 90_001, 1_000
"""Seeds of the new gears and of the recordings."""
LEARNERS = ("templates", "lda", "boosting")
RESAMPLES = 1000
Rows = list[dict[str, Any]]

SPEED = {"speed": {"depth": 0.01, "period": 0.25}}
TORQUE = {"torque": {"depth": 0.09, "period": 0.25}}
SHAFTS = {
    "shafts": (
        {"shaft": "gear-shaft", "harmonics": (1.0, 2.0, 4.0), "amplitude": 1.0},
        {"harmonics": (0.737, 1.474), "amplitude": 1.0},
    )
}
WHOLE = {"shafts": ({"shaft": "gear-shaft", "harmonics": (3.0,), "amplitude": 0.5},)}
"""The third harmonic of the gear's shaft is the first of the pinion's: no average parts them."""
BEARINGS = {
    "bearings": (
        {
            "bearing": {
                "rolling_elements": 13,
                "rolling_diameter": 0.0127,
                "pitch_diameter": 0.0825,
                "contact_angle_deg": 15.0,
            },
            "outer": 1.0,
            "inner": 1.0,
        },
    )
}
MOUNTING = {"path": {"frequency": 28e3, "damping_ratio": 0.03}}
JITTER = {"tacho": {"jitter": 10e-6}}
COLOUR, REDDER = {"corner_frequency": 20e3}, {"corner_frequency": 2e3}


@dataclass(frozen=True, kw_only=True)
class Cause:
    """Ingredients that are switched on together.

    Attributes
    ----------
    surroundings
        Those that are no noise.
    colour
        What differs of the noise.
    rate
        Sampling rate, Hz.
    like_at_mesh
        Whether coloured noise has the density of the white one at the mesh frequency, and not its variance.
    """

    surroundings: dict[str, Any] = field(default_factory=dict)
    colour: dict[str, float] = field(default_factory=dict)
    rate: float = RATE
    like_at_mesh: bool = False


CAUSES = {
    "none": Cause(),
    "speed wanders by 1 %": Cause(surroundings=SPEED),
    "speed 1 % above": Cause(surroundings={"speed": {"offset": 0.01}}),
    "speed 3 % above": Cause(surroundings={"speed": {"offset": 0.03}}),
    "torque wanders by 9 %": Cause(surroundings=TORQUE),
    "torque 9 % below": Cause(surroundings={"torque": {"offset": -0.09}}),
    "tones of other shafts": Cause(surroundings=SHAFTS),
    "tone at a whole order": Cause(surroundings=WHOLE),
    "tones of bearings": Cause(surroundings=BEARINGS),
    "gain 20 % low": Cause(surroundings={"path": {"frequency": 90e3, "damping_ratio": 0.7, "gain": 0.8}}),
    "mounting, 28 kHz": Cause(surroundings=MOUNTING),
    "housing wall, 7 kHz": Cause(surroundings={"path": {"frequency": 7e3, "damping_ratio": 0.05}}),
    "coloured noise, same variance": Cause(colour=COLOUR),
    "coloured noise, same at mesh": Cause(colour=REDDER, like_at_mesh=True),
    "tacho jitter, 10 us": Cause(surroundings=JITTER),
    "sampled at 51.2 kHz": Cause(rate=LOW_RATE),
    "together": Cause(
        surroundings=SPEED | TORQUE | SHAFTS | BEARINGS | MOUNTING | JITTER, colour=REDDER, like_at_mesh=True
    ),
}
"""Each with sizes that are assumed, within what tests of such rigs held: speed 6 %, torque 18 % (published)."""


def main() -> None:
    """Print the tables, the table of the docs, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    shown = parser.add_mutually_exclusive_group()
    json_option(shown)
    shown.add_argument("--markdown", action="store_true", help="print the table of docs/theory/measured.md")
    parser.add_argument("--cases", type=int, default=CASES, help=f"damages with a tooth and gears each; {CASES}")
    parser.add_argument("--repeats", type=int, default=REPEATS, help=f"recordings of each case; {REPEATS}")
    parser.add_argument("--snr-db", type=float, default=SNR_DB, help=f"noise of the database; {SNR_DB}")
    given = parser.parse_args()
    machine = environment("numpy", "scipy", "scikit-learn", "numba")
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1):
        tables, seconds = timed(lambda: measure(Path(folder), given.cases, given.repeats, given.snr_db))
    machine |= {"averages a line": given.cases * given.repeats, "seconds of processor": round(seconds)}
    if given.markdown:
        print_markdown(tables)
        return
    publish(machine, tables, given.json)


def measure(folder: Path, cases: int, repeats: int, snr_db: float) -> dict[str, Rows]:
    """Tables by title."""
    database = made_database(folder, snr_db)
    (point,), _ = operating_points(database)
    curve = error_curve([point], draws=4000)
    models = {target: train(database, target) for target in ("location", "severity")}
    chosen = drawn_cases(database, point, cases)
    recipe = load_recipe(RECIPE)
    prepared = prepare_periodic(recipe.rig, gear=recipe.sections.sweep.gear)
    recorder = Recorder(rig=recipe.rig, prepared=prepared, cases=chosen, snr_db=snr_db)
    found = recorder.averages(CAUSES, repeats)
    wrong = {
        name: {
            learner: models["location"].estimators[learner].predict(rows) != rows["tooth"].to_numpy()
            for learner in LEARNERS
        }
        for name, rows in found.items()
    }
    return {
        "The bound": bound_rows(point, curve, found["none"], wrong["none"]),
        "Location": location_rows(curve, wrong, repeats),
        "Severity": severity_rows(models["severity"].estimators, found, repeats),
        "What was recorded": recorded_rows(found),
    }


def made_database(folder: Path, snr_db: float) -> Database:
    """The quick recipe at another level of noise."""
    text = RECIPE.read_text(encoding="utf-8").replace("snr_db = -10.0", f"snr_db = {snr_db}")
    path = folder / "recipe.toml"
    path.write_text(text, encoding="utf-8")
    recipe = load_recipe(path)
    run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
    return sigdb.open(folder / "signatures")


def drawn_cases(database: Database, point: OperatingPoint, count: int) -> pd.DataFrame:
    """Rows of the database, as evenly over its templates and teeth as its own rows are."""
    rows = point.rows.sort_values(["place", "tooth", "specimen"])
    places = ((np.arange(count) + 0.5) * len(rows) / count).astype(int)
    columns = "tooth, damaged_teeth, phase_shift_deg, stiffness_loss, averages, index_error, speed_rpm, torque, teeth"
    cases = database.sql(f"select id, {columns} from cases order by id").set_index("id")
    return cases.loc[rows.index[places]].reset_index(drop=True)


@dataclass(frozen=True, kw_only=True)
class Recorder:
    """Makes averages of recordings of cases."""

    rig: Transmission
    prepared: PeriodicRig
    cases: pd.DataFrame
    snr_db: float

    def averages(self, causes: Mapping[str, Cause], repeats: int) -> dict[str, pd.DataFrame]:
        """By cause rows as the models read them, some recordings of each case in turn."""
        found: dict[str, Rows] = {name: [] for name in causes}
        for i, (_, case) in enumerate(self.cases.iterrows()):
            motions: dict[Any, Motion] = {}  # causes that march alike share one
            for name, cause in causes.items():
                surroundings = Surroundings(**cause.surroundings, noise=self._noise(cause))
                key = (surroundings.speed, surroundings.torque, cause.rate)
                if key not in motions:
                    motions[key] = self._motion(i, case, surroundings, cause.rate)
                for seed in range(NOISE + i * repeats, NOISE + (i + 1) * repeats):
                    recording = record(motions[key], surroundings, seed=seed)
                    found[name].append({"case": i} | dict(case) | averaged(recording, case))
        types = {"tooth": int, "teeth": int, "averages": int}
        return {name: _with_features(pd.DataFrame(rows).astype(types)) for name, rows in found.items()}

    def _noise(self, cause: Cause) -> dict[str, float]:
        """Noise of the density of the database's, whose revolutions have n samples."""
        samples_a_second = self.prepared.samples * self.prepared.shaft_speed / (2 * np.pi)
        snr_db = self.snr_db - 10 * np.log10(cause.rate / samples_a_second)
        if cause.like_at_mesh:
            snr_db += 10 * np.log10(colour_at_mesh(self.prepared, cause))
        return {"snr_db": float(snr_db), **cause.colour}

    def _motion(self, i: int, case: pd.Series, surroundings: Surroundings, rate: float) -> Motion:
        teeth, (mesh,) = self.prepared.teeth, self.rig.meshes.values()
        mate = self.rig.gears[mesh.driven].teeth
        return simulate_motion(
            self.rig,
            damage_of(case, self.prepared.gear),
            sampling_rate=rate,
            revolutions=int(case["averages"]),
            index_errors=case["index_error"] * index_errors(specimen_stream(SPECIMENS, i), teeth, mate),
            surroundings=surroundings,
            seed=NOISE + i,
            steps_per_tooth=STEPS_PER_TOOTH,
            prepared=self.prepared,
        )


def colour_at_mesh(prepared: PeriodicRig, cause: Cause) -> float:
    """Power density of the coloured noise at the mesh frequency against white noise of the same variance."""
    frequency = prepared.teeth * prepared.shaft_speed / (2 * np.pi)
    return float(relative_density(np.array(frequency), cause.rate, cause.colour["corner_frequency"]))


def damage_of(case: pd.Series, gear: str) -> sigdb.Damage | None:
    """The damage of a row."""
    if not case["tooth"]:
        return None
    return sigdb.Damage(
        gear=gear,
        tooth=int(case["tooth"]),
        damaged_teeth=int(case["damaged_teeth"]),
        phase_shift_deg=float(case["phase_shift_deg"]),
        stiffness_loss=float(case["stiffness_loss"]),
    )


def averaged(recording: Any, case: pd.Series) -> dict[str, Any]:
    """The average of a recording by its tacho, and its scatter."""
    signal, tacho = recording.signals[0], recording.channel(recording.tacho)
    average = synchronous_average(
        signal.samples,
        signal.sampling_rate,
        tacho_pulses(tacho.samples, tacho.sampling_rate),
        samples_per_rev=64 * int(case["teeth"]),
        pulses_per_rev=int(recording.pulses_per_rev),
        ratio=recording.ratio,
        revolutions=int(case["averages"]),
    )
    return {
        "tsa": average.tsa,
        "scatter": float(np.sqrt(np.mean(average.scatter**2))),
        "speed_rpm": recording.speed_rpm,
        "torque": recording.torque,
        "contact": recording.notes[0].values["contact"],
    }


def _with_features(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows with the features that a database holds, made as it makes them."""
    teeth, step = int(rows["teeth"].iloc[0]), 64
    tsa = np.stack(rows["tsa"].to_list())
    cells = pooled_wigner_ville(tsa, teeth=teeth, bands=mesh_bands(teeth), lag_window=2 * step, n_bins=6 * step)
    features = cells.reshape(len(rows), -1) / (6 * step * step)
    return rows.assign(wigner_ville=list(features), fm4=fm4(difference_signal(tsa, teeth=teeth)))


def bound_rows(point: OperatingPoint, curve: ErrorCurve, rows: pd.DataFrame, wrong: Mapping[str, Any]) -> Rows:
    """The best rule on the same averages without any ingredient, and whether a model is better."""
    level = point.rows["noise"].iloc[0]
    known = point.posterior(np.stack(rows["tsa"].to_list()), rows[["index_error"]].assign(noise=level))
    best = (known.tooth != rows["tooth"].to_numpy()).astype(float)
    expected, error = float(np.interp(0.0, curve.decibels, curve.error)), float(best.mean())
    found: Rows = [
        {"who": "Bayes rule, rows of its law", "error": expected, "better than the rule": None},
        {"who": "Bayes rule, these averages", "error": error, "better than the rule": None},
    ]
    for name, one in wrong.items():
        excess = above_bound(one.astype(float), best, rows["case"].to_numpy())
        found.append({"who": name, "error": float(one.mean()), "better than the rule": bool(excess.significant)})
    return found


def location_rows(curve: ErrorCurve, wrong: Mapping[str, Mapping[str, Any]], repeats: int) -> Rows:
    """Accuracy and loss by cause and learner, with intervals."""
    cases = len(next(iter(wrong["none"].values()))) // repeats
    resampled = np.random.default_rng(0).integers(cases, size=(RESAMPLES, cases))
    found: Rows = []
    for learner in LEARNERS:
        errors = {name: one[learner].reshape(cases, repeats).mean(axis=1) for name, one in wrong.items()}
        base = curve.loss_db(errors["none"].mean()), curve.loss_db(errors["none"][resampled].mean(axis=1))
        for name, error in errors.items():
            drawn = error[resampled].mean(axis=1)
            loss, spread = curve.loss_db(error.mean()), curve.loss_db(drawn)
            found.append(
                {
                    "learner": learner,
                    "cause": name,
                    "accuracy": 1 - float(error.mean()),
                    **_interval("accuracy", 1 - drawn),
                    "loss": _plain(loss),
                    **_interval("loss", spread),
                    "of the cause": _plain(loss - base[0]),
                    **_interval("of the cause", spread - base[1]),
                }
            )
    return found


def severity_rows(estimators: Mapping[str, Any], found: Mapping[str, pd.DataFrame], repeats: int) -> Rows:
    """Mean absolute errors of the severity of damaged gears."""
    rows: Rows = []
    for learner in LEARNERS:
        for name, all_rows in found.items():
            some = all_rows[all_rows["tooth"] > 0]
            answer = estimators[learner].predict(some)
            row: dict[str, Any] = {"learner": learner, "cause": name}
            for target in ("stiffness_loss", "phase_shift_deg"):
                off = np.abs(answer[target].to_numpy() - some[target].to_numpy(float)).reshape(-1, repeats).mean(axis=1)
                resampled = np.random.default_rng(0).integers(len(off), size=(RESAMPLES, len(off)))
                row |= {target: float(off.mean()), **_interval(target, off[resampled].mean(axis=1))}
            rows.append(row)
    return rows


def recorded_rows(found: Mapping[str, pd.DataFrame]) -> Rows:
    """What the averages of a cause look like beside those without any."""
    clean = np.stack(found["none"]["tsa"].to_list())
    rows: Rows = []
    for name, one in found.items():
        off = np.stack(one["tsa"].to_list()) - clean
        rows.append(
            {
                "cause": name,
                "averages": len(one),
                "scatter": float(one["scatter"].mean() / found["none"]["scatter"].mean()),
                "average off": float(np.sqrt((off**2).mean() / clean.var())),
                "speed_rpm": float(one["speed_rpm"].mean()),
                "torque": float(one["torque"].mean()),
                "contact lost": int((one["contact"] < 1).sum()),
            }
        )
    return rows


def _plain(value: Any) -> float | None:
    return None if np.isnan(value) else float(value)


def _interval(name: str, drawn: np.ndarray) -> dict[str, float | None]:
    """Ends of 95 %; none where a twentieth of the draws lies where no loss can be estimated."""
    known = drawn[np.isfinite(drawn)]
    low, high = np.percentile(known, [2.5, 97.5]) if len(known) > 0.95 * len(drawn) else (None, None)
    return {f"{name} low": None if low is None else float(low), f"{name} high": None if high is None else float(high)}


MARKDOWN = {
    "accuracy": "right locations, %",
    "loss": "loss, dB",
    "of the cause": "of the cause, dB",
    "stiffness_loss": "loss of stiffness off by, %",
    "phase_shift_deg": "phase shift off by, deg",
}
"""Columns of the tables of the docs."""


def print_markdown(tables: Mapping[str, Rows]) -> None:
    """A table for each learner, with a line for each cause."""
    severity = {(row["learner"], row["cause"]): row for row in tables["Severity"]}
    for learner in LEARNERS:
        print(f"\n{learner}\n\n| ingredient | {' | '.join(MARKDOWN.values())} |\n|{'---|' * (1 + len(MARKDOWN))}")
        for row in tables["Location"]:
            if row["learner"] == learner:
                both = row | severity[learner, row["cause"]]
                print(f"| {row['cause']} | {' | '.join(_shown(both, name) for name in MARKDOWN)} |")


def _shown(row: Mapping[str, Any], name: str) -> str:
    """A figure with its interval."""
    if name == "of the cause" and row["cause"] == "none":
        return ""
    values = [row[end] for end in (name, f"{name} low", f"{name} high")]
    if values[0] is None:
        return "not estimated"
    places, scale = {"accuracy": (0, 100), "stiffness_loss": (1, 100), "phase_shift_deg": (2, 1)}.get(name, (1, 1))
    value, low, high = ("-" if one is None else f"{scale * one:.{places}f}" for one in values)
    return f"{value} ({low} to {high})" if "-" not in (low, high) else value


if __name__ == "__main__":
    main()
