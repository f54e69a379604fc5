"""A model's card, and the table of figures that evaluation prints."""

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from sigdb.recognition.bound.efficiency import ALL
from sigdb.recognition.estimators.pooled_location import LEARNERS
from sigdb.recognition.evaluation import Evaluation
from sigdb.recognition.metrics.estimate import Estimate
from sigdb.recognition.severity_quantities import QUANTITIES
from sigdb.recognition.training import Model

_COLUMNS = {
    "error": "error",
    "bound_error": "bound's",
    "eta_info": "information used",
    "loss_db": "loss, dB",
    "a90_ratio": "a90 / bound's",
    "ece": "ECE",
    "mae_ratio": "MAE / bound's",
    "crps_ratio": "CRPS / bound's",
    "rmse_ratio": "RMSE / bound's",
}
_PLAIN = ("error", "bound_error")
_ENDS = {"value": "", "low": "_low", "high": "_high"}


def efficiency_rows(evaluation: Evaluation) -> list[list[str]]:
    """Head and rows of a model against the bound, a row for each noise band; none where that is not known."""
    table = evaluation.efficiency
    if table is None or not {"bound_error", "bound_a90"} & set(table):
        return []
    shown = [name for name in _COLUMNS if name in table and table[name].notna().any()]
    target = ["target"] if "target" in table else []
    head = [*target, "noise", "rows", *(_COLUMNS[name] for name in shown)]
    rows = table.to_dict("records")
    return [head] + [
        [*(str(row[name]) for name in target), noise_said(row), str(row["rows"]), *(_said(name, row) for name in shown)]
        for row in rows
    ]


def noise_said(row: Mapping[Hashable, Any]) -> str:
    """The noise of a row of the table, in words."""
    if row["band"] != ALL:
        return str(row["band"])
    return f"{row['low_db']:g} dB" if row["low_db"] == row["high_db"] else "all"


def _said(name: str, row: Mapping[Hashable, Any]) -> str:
    if name in _PLAIN:
        return f"{row[name]:.3f}"
    one = Estimate(**{end: row[f"{name}{column}"] for end, column in _ENDS.items()})
    return "beyond" if np.isinf(one.value) else str(one)


def aim_rows(evaluation: Evaluation) -> list[list[str]]:
    """Head and rows of the aims: what, aim, found, whether it is met, and why not; none where they are not known."""
    if evaluation.aims is None or evaluation.aims.empty:
        return []
    return [["aim", "at most", "found", "met", "why"]] + [
        [str(row["what"]), f"{row['aim']:g}", _found(row), _met(row["met"]), _sentence(str(row["why"]))]
        for row in evaluation.aims.to_dict("records")
    ]


def _found(row: Mapping[Hashable, Any]) -> str:
    if np.isnan(row["found"]):
        return "-"
    value = "beyond" if np.isinf(row["found"]) else str(Estimate(value=row["found"], low=row["low"], high=row["high"]))
    return f"{value} ({row['where']})" if row["where"] not in ("", ALL) else value


def _met(met: Any) -> str:
    return "not judged" if pd.isna(met) else "yes" if met else "no"


def _sentence(why: str) -> str:
    return why[:1].upper() + why[1:].rstrip(".") + "." if why else ""


_OF_LOCATION = {
    "accuracy": "P(correct), healthy too",
    "p_exact": "P(exact tooth)",
    "p_within_one": "P(within one)",
    "p_detected": "P(detected)",
    "none_on_healthy": "'none' on healthy",
    "circular_bias": "circular bias, teeth",
    "false_alarm_rate": "false-alarm rate",
    "pd_at_1e-2": "P(detected) at 1e-2 false alarms",
    "pd_at_1e-3": "P(detected) at 1e-3 false alarms",
    "pd_at_1e-4": "P(detected) at 1e-4 false alarms",
    "a90": "a90, stiffness loss",
    "a90_95": "a90/95, stiffness loss",
    "log_loss": "log loss, nats",
    "brier": "Brier score",
    "ece": "calibration error (ECE)",
    "set_size": "classes in a 90 % set",
    "set_coverage": "coverage of 90 % sets",
    "set_coverage_damaged": "coverage of 90 % sets, damaged",
    "set_coverage_healthy": "coverage of 90 % sets, healthy",
}
_OF_SEVERITY = {
    "mae": "MAE {}",
    "rmse": "RMSE {}",
    "bias": "bias {}",
    "crps": "CRPS {}",
    "coverage": "coverage of 90 % interval, {}",
}
_UNITS = {"phase_shift_deg": "phase_shift_deg, deg"}
TITLES = _OF_LOCATION | {
    f"{kind}_{target}": title.format(target if kind == "coverage" else _UNITS.get(target, target))
    for kind, title in _OF_SEVERITY.items()
    for target in QUANTITIES
}
"""Names of figures as a reader sees them."""


def figure_rows(evaluation: Evaluation) -> list[list[str]]:
    """Head and rows of the table of figures: a row for each figure that is known of any, a column for each
    estimator and for the bound."""
    names = list(evaluation.figures)
    heads = [f"{name} (the model)" if name == evaluation.learner else name for name in names]
    columns = [evaluation.figures[name] for name in names]
    if evaluation.bound is not None:
        heads, columns = [*heads, "bound"], [*columns, dict(evaluation.bound)]
    return [["figure", *heads]] + [
        [title, *(str(figures.get(key, "")) for figures in columns)]
        for key, title in TITLES.items()
        if any(key in figures and not np.isnan(figures[key].value) for figures in columns)
    ]


def bound_said(evaluation: Evaluation) -> str:
    """A sentence on the bound."""
    if evaluation.bound is None:
        return "The best possible answer (the Bayes bound) is not computed."
    if evaluation.bound_rows in (None, evaluation.rows):
        return "'bound' is the best possible answer."
    return (
        f"'bound' is the best possible answer to {evaluation.bound_rows} of the rows; the others are outside of the\n"
        "law that it is computed from."
    )


def model_card(model: Model, evaluation: Evaluation, *, command: str) -> str:
    """The card as Markdown."""
    return f"""# {model.target.capitalize()} of tooth damage: {LEARNERS[model.learner]}

**Purpose.** {_PURPOSE[model.target]}

**Not for.** Other rigs, sensors or operating points than those of its training database; decisions about safety. Its
training data is simulated: on a measured signal its answer is a hypothesis to be checked.

**Training data.** {model.rows} simulated signatures of sensor `{model.sensor}` from {len(model.trained_on)} specimens
of the database `{model.database_hash[:12]}`, seed {model.seed}; split {model.split}, table of folds
`{model.split_hash[:12]}`. {_drawn(model)}

**Input.** {_INPUT.get(model.learner, _POOLED_INPUT)}

## Figures

Split: {evaluation.split}. {evaluation.rows} rows of
{evaluation.specimens} specimens; in brackets the 95 % interval of a bootstrap over specimens, which is rough for few.
{_SAME_DAMAGES if evaluation.split.startswith("S1") else ""}{bound_said(evaluation)}

{_markdown(figure_rows(evaluation))}

{_BASELINES[model.target].format(rate=model.false_alarm_rate)}

{_against_bound(evaluation)}**Known failures.** {_FAILURES[model.target]}

## Make it again

    {command}
"""


def _markdown(rows: list[list[str]]) -> str:
    """A table as Markdown."""
    head, *rows = rows
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _against_bound(evaluation: Evaluation) -> str:
    """The section on the best possible answer, and on the aims."""
    efficiency, aims = efficiency_rows(evaluation), aim_rows(evaluation)
    parts = [EFFICIENCY_SAID[evaluation.target], _markdown(efficiency)] if efficiency else []
    parts += ["Aims, judged where the noise band is worst:", _markdown(aims)] if aims else []
    return "\n\n".join(["## Against the best possible", *parts]) + "\n\n" if parts else ""


_IN_BANDS = "In bands of the signal-to-noise ratio of one revolution, on the rows whose law the bound knows"
EFFICIENCY_SAID = {
    "location": f"""{_IN_BANDS}: 'information used' is
(H - log loss) / (H - the bound's log loss), with H of what is known before; 'loss' by how much the noise may grow until
the best rule has as many errors.""",
    "detection": f"{_IN_BANDS}.",
    "severity": f"""{_IN_BANDS}: mean absolute error
against the posterior's median, CRPS by the same quantiles, root mean square error against the posterior's mean.""",
}
"""What the table of a model against the bound shows, in words."""


def _drawn(model: Model) -> str:
    if model.drawn_rows == model.rows:
        return "All estimators learnt from all of them."
    return (
        f"The bank of templates was calibrated on all of them; all else learnt\nfrom {model.drawn_rows} of them, drawn "
        "evenly over specimens and cases."
    )


_SAME_DAMAGES = (
    "The test asks about the same damages as the training rows hold, on other gears: between and beyond them the "
    "figures are\nworse. "
)
_POOLED_INPUT = (
    "Pooled Wigner-Ville features, speed and torque, seen from each tooth in turn; the scatter between revolutions\n"
    "and their number, which tell the noise."
)
_INPUT = {
    "templates": "The average itself, its number of revolutions, the scatter between them (the noise), speed and\n"
    "torque; templates of the nearest operating point, index errors of the size that the training rows have."
}
_PURPOSE = {
    "location": "Says at which tooth of the averaged gear the first damaged tooth is, or 'none'. Absolute tooth\n"
    "numbers need the tacho mark.",
    "detection": "Says whether a gear has a damaged tooth, at a rate of false alarms that was set.",
    "severity": "Estimates stiffness loss, phase shift and number of damaged teeth of a damaged gear, each with an\n"
    "interval.",
}
_BASELINES = {
    "location": """Baselines: `whitened_bank`, the likelihoods of the templates as they are; `nearest_template`, the
least Euclidean distance; `envelope_peak`, the tooth in whose pass the envelope of the residual is greatest; thresholds
on `na4_star` and `fm4`, which name no tooth, so the most frequent one is taken; `majority`, the most frequent answer of
the training rows. Their thresholds are set at a false-alarm rate of {rate:g}.""",
    "severity": "Baselines: `fm4`, a monotonic function of FM4; `majority`, the median of the training rows.",
    "detection": """All are set at a false-alarm rate of {rate:g}, on healthy rows of specimens that they have not
learnt from. Baselines: `nearest_template`, by how much the nearest damaged template is nearer than the healthy one;
`envelope_peak`, `na4_star` and `fm4`.""",
}
_FAILURES = {
    "location": "The least severe cases are missed most often. Damage of another kind than was simulated is still\n"
    "given a tooth.",
    "detection": "The least severe cases are missed most often. The rate of false alarms holds on average over gears,\n"
    "and may be another one for one of them.",
    "severity": "On a healthy gear its answer has no meaning. Intervals hold for each severity on average over gears,\n"
    "and may hold less often for one of them.",
}
