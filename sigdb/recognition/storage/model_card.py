"""A model's card, and the tables of an evaluation as text."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sigdb.core import markdown_table
from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition.bound.noise_bands import ALL
from sigdb.recognition.criteria import CriterionResult
from sigdb.recognition.estimators.registry import LEARNERS
from sigdb.recognition.evaluation import Evaluation
from sigdb.recognition.metrics.estimate import Estimate
from sigdb.recognition.model import Model
from sigdb.recognition.rows.batch import CELLS
from sigdb.recognition.targets.all_targets import TARGETS
from sigdb.recognition.templates.bank import TemplateBank

Cell = Estimate | str
"""A cell of a table: an estimate, or text."""


@dataclass(frozen=True, kw_only=True)
class EstimateTable:
    """A table of texts and estimates.

    Attributes
    ----------
    head
        Headings of the columns.
    rows
        Cells of each row.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]

    def __bool__(self) -> bool:
        return bool(self.rows)

    @property
    def lines(self) -> list[list[str]]:
        """Head and rows as text."""
        return [list(self.head), *([str(cell) for cell in row] for row in self.rows)]


_EFFICIENCY = {
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
_WITHOUT_INTERVAL = ("error", "bound_error")
_ENDS = {"value": "", "low": "_low", "high": "_high"}


def metric_table(evaluation: Evaluation) -> EstimateTable:
    """Return a row for each metric that is known of any estimator, a column for each estimator and for the bound."""
    columns = {
        f"{name} (the model)" if name == evaluation.learner else name: metrics
        for name, metrics in evaluation.metrics.items()
    }
    if evaluation.bound is not None:
        columns["bound"] = evaluation.bound
    if evaluation.bound_whole_grid is not None:
        columns["bound, whole grid"] = evaluation.bound_whole_grid
    rows = [
        [metric.title, *(_shown(metrics.get(metric.name), metric.factor) for metrics in columns.values())]
        for metric in TARGETS[evaluation.target].metrics
        if any(_is_known(metrics.get(metric.name)) for metrics in columns.values())
    ]
    return EstimateTable(head=["metric", *columns], rows=rows)


def _shown(estimate: Estimate | None, factor: float) -> Cell:
    return "" if estimate is None else estimate.times(factor)


def _is_known(estimate: Estimate | None) -> bool:
    return estimate is not None and not np.isnan(estimate.value)


def efficiency_cells(evaluation: Evaluation) -> EstimateTable:
    """Return the model compared with the bound, a row for each noise band; no rows without a bound."""
    table = evaluation.efficiency
    if table is None or not {"bound_error", "bound_a90"} & set(table):
        return EstimateTable(head=[], rows=[])
    shown = [name for name in _EFFICIENCY if name in table and table[name].notna().any()]
    quantity = ["quantity"] if "quantity" in table else []
    rows = [
        [
            *(_quantity_title(str(row[name])) for name in quantity),
            noise_text(row),
            str(row["rows"]),
            *(_efficiency_cell(name, row) for name in shown),
        ]
        for row in table.to_dict("records")
    ]
    return EstimateTable(head=[*quantity, "noise", "rows", *(_EFFICIENCY[name] for name in shown)], rows=rows)


def _quantity_title(name: str) -> str:
    shown = SHOWN_QUANTITIES[name]
    return name if shown.factor == 1 else f"{name}, {shown.unit}"


def _factor(row: Mapping[Hashable, float | str]) -> float:
    return SHOWN_QUANTITIES[str(row["quantity"])].factor if "quantity" in row else 1.0


def noise_text(row: Mapping[Hashable, float | str]) -> str:
    """Return the noise of a row of the table of efficiency as text."""
    if row["band"] != ALL:
        return str(row["band"])
    return f"{row['low_db']:g} dB" if row["low_db"] == row["high_db"] else "all"


def _efficiency_cell(name: str, row: Mapping[Hashable, float]) -> Cell:
    if name in _WITHOUT_INTERVAL:
        return f"{row[name] * _factor(row):.3f}"
    estimate = Estimate(**{end: row[f"{name}{suffix}"] for end, suffix in _ENDS.items()})
    return "beyond" if np.isinf(estimate.value) else estimate


def criteria_table(evaluation: Evaluation) -> EstimateTable:
    """Return the criteria: title, limit, value, band, whether it is met, and why not; no rows without criteria."""
    rows = [
        [result.title, f"{result.limit:g}", _value(result), result.band, _met_text(result.met), _reason(result)]
        for result in evaluation.criteria
    ]
    return EstimateTable(head=["criterion", "at most", "value", "noise", "met", "why"], rows=rows)


def _value(result: CriterionResult) -> Cell:
    return "beyond" if np.isinf(result.value) else Estimate(value=result.value, low=result.low, high=result.high)


def _met_text(met: bool | None) -> str:
    return "not estimated" if met is None else "yes" if met else "no"


def _reason(result: CriterionResult) -> str:
    text = "" if result.note is None else result.note.text
    return f"{text[:1].upper()}{text[1:].rstrip('.')}." if text else ""


_OUTCOMES = {
    "right": "right",
    "not_sure": "not sure",
    "outside": "outside",
    "sure_wrong": "sure and wrong",
    "alarms_0.01": "alarms at 1e-2",
    "alarms_0.001": "alarms at 1e-3",
    "loss_db": "loss, dB",
}


def robustness_cells(evaluation: Evaluation) -> EstimateTable:
    """Return the outcomes under each disturbance, a row each; no rows where robustness was not tested."""
    table = evaluation.tables.get("robustness")
    if table is None:
        return EstimateTable(head=[], rows=[])
    shown = [name for name in _OUTCOMES if table[name].notna().any()]
    rows = [[str(row["text"]), *(_outcome(name, row[name]) for name in shown)] for row in table.to_dict("records")]
    return EstimateTable(head=["disturbance", *(_OUTCOMES[name] for name in shown)], rows=rows)


def _outcome(name: str, value: float) -> str:
    if np.isnan(value):
        return "-"
    if np.isinf(value):
        return "beyond"
    return f"{value:.1f}" if name == "loss_db" else f"{value:.3f}"


def robustness_text(evaluation: Evaluation) -> str:
    """Return sentences on the table of robustness; empty where it was not tested."""
    table = evaluation.tables.get("robustness")
    if table is None:
        return ""
    return (
        f"{int(table['rows'].max())} rows of the database's cases, simulated anew with one disturbance at a time. "
        "'Right' and 'sure and wrong' are shares of rows with a single answer in their set, 'outside' of rows that are "
        "outside by the model's own verdict. Alarms are shares of healthy rows that are not outside and have a greater "
        "score than the stated share of the healthy rows of the database in their band of noise. 'Loss' is the "
        "increase of the noise at which the best possible answer to the same rows has as many errors: that of a law "
        "whose only nuisance is the disturbance."
    )


def bound_text(evaluation: Evaluation) -> str:
    """Return a sentence on the bound."""
    if evaluation.bound is None:
        reasons = [note.text for note in evaluation.notes if note.code == "no-bound"]
        return f"The best possible answer (the Bayes bound) is not computed{_because(reasons)}."
    whole = "" if evaluation.bound_whole_grid is None else f" {_WHOLE_GRID}"
    if evaluation.bound_rows in (None, evaluation.rows):
        return f"'bound' is the best possible answer.{whole}"
    return (
        f"'bound' is the best possible answer to {evaluation.bound_rows} of the rows; the others are outside the\n"
        f"law that it is computed from.{whole}"
    )


_WHOLE_GRID = (
    "It knows which cases occur. 'bound, whole grid' does not:\nto it, any case of the database is possible, and "
    "any severity between those of the templates."
)


def _because(reasons: Sequence[str]) -> str:
    return f": {'; '.join(reasons)}" if reasons else ""


def _sizes(model: Model) -> str:
    names = getattr(model.estimator, "quantities_", ())
    return f" They are: {', '.join(SHOWN_QUANTITIES[name].title for name in names)}." if names else ""


def limitation_texts(evaluation: Evaluation) -> list[str]:
    """Return the known limitations of the model on the rows, as sentences."""
    return [note.text for note in evaluation.notes if note.code != "no-bound"]


def model_card(
    model: Model, evaluation: Evaluation, *, command: str, elsewhere: Mapping[str, Evaluation] | None = None
) -> str:
    """Return the card of a model as Markdown.

    Parameters
    ----------
    model
        A trained model.
    evaluation
        Its evaluation.
    command
        The command that makes it again.
    elsewhere
        By name, its evaluations on other databases.
    """
    text = TARGETS[model.target].text
    return f"""# {model.target.capitalize()} of tooth damage: {LEARNERS[model.learner]}

**Purpose.** {text.purpose}{_sizes(model)}

**Not for.** Other rigs, sensors or operating points than those of its training database; decisions about safety. Its
training data is simulated: on a measured signal its answer is a hypothesis to be checked.

**Training data.** {model.rows} simulated signatures of sensor `{model.sensor}` from {len(model.trained_on)} specimens
of the database `{model.database_hash[:12]}`, seed {model.seed}; split {model.split}, table of folds
`{model.split_hash[:12]}`. {_training_rows(model)}

**Input.** {_input(model)}

## Metrics

Split: {evaluation.split}, {evaluation.split_text}. {evaluation.rows} rows of
{evaluation.specimens} specimens; in brackets the 95 % interval over specimens, by Student's t for fewer than 30.
{_SAME_DAMAGES if evaluation.split == "S1" else ""}{bound_text(evaluation)}

{_markdown(metric_table(evaluation))}

{text.baselines.format(rate=model.false_alarm_rate)}

{_against_bound(evaluation)}{_elsewhere(elsewhere or {})}**Known failures.** {text.failures}

## Make it again

    {command}
"""


def _markdown(table: EstimateTable) -> str:
    head, *rows = table.lines
    return markdown_table(head, rows)


def _against_bound(evaluation: Evaluation) -> str:
    """Return the section on the best possible answer, and the criteria."""
    efficiency, criteria = efficiency_cells(evaluation), criteria_table(evaluation)
    parts = []
    if efficiency:
        parts += ["## Against the best possible", TARGETS[evaluation.target].text.efficiency, _markdown(efficiency)]
    if limits := limitation_texts(evaluation):
        parts += ["\n".join(f"- {text}" for text in limits)]
    if robustness := robustness_cells(evaluation):
        parts += ["## Robustness", robustness_text(evaluation), _markdown(robustness)]
    if criteria:
        parts += ["## Criteria", "Each in the worst noise band:", _markdown(criteria)]
    return "\n\n".join(parts) + "\n\n" if parts else ""


def _elsewhere(evaluations: Mapping[str, Evaluation]) -> str:
    """Return a section on each other database: metrics of the model and of the best possible answers."""
    parts = []
    for name, evaluation in evaluations.items():
        table = metric_table(evaluation)
        kept = [place for place, title in enumerate(table.head) if title.startswith(("metric", "bound"))]
        kept.insert(1, next(place for place, title in enumerate(table.head) if title.endswith("(the model)")))
        rows = [[row[place] for place in kept] for row in table.rows if row[kept[1]]]
        parts += [
            f"## On {name}",
            f"{evaluation.rows} rows of {evaluation.specimens} specimens. {bound_text(evaluation)}",
            _markdown(EstimateTable(head=[table.head[place] for place in kept], rows=rows)),
        ]
        if efficiency := efficiency_cells(evaluation):
            parts += [_markdown(efficiency)]
    return "\n\n".join(parts) + "\n\n" if parts else ""


def _training_rows(model: Model) -> str:
    if model.drawn_rows == model.rows:
        return "All estimators learnt from all of them."
    return (
        f"The bank of templates was calibrated on all of them; all else learnt\nfrom {model.drawn_rows} of them, drawn "
        "evenly over specimens and cases."
    )


_SAME_DAMAGES = (
    "The test rows have the damages of the training rows, on other gears: between and beyond them the metrics are\n"
    "worse. "
)
_POOLED_INPUT = (
    "Pooled Wigner-Ville features, speed and torque, seen from each tooth in turn; the noise, from the scatter\n"
    "between revolutions and their number."
)
_TEMPLATE_INPUT = (
    "The average itself, its number of revolutions, the scatter between them (the noise), speed and\n"
    "torque; index errors of the size that the training rows have. {}"
)


def _points_text(bank: TemplateBank) -> str:
    """Return the sentences on the operating points of a bank."""
    if not bank.interpolations:
        return "Templates are those of the nearest operating point."
    parts = [
        f"Templates of {between.teeth} teeth are\ninterpolated over {between.speeds} speeds, from "
        f"{between.speed_rpm[0]:.6g} to {between.speed_rpm[1]:.6g} rpm, with an error of at\nmost {between.error:.1g} "
        "standard deviations of the noise of the quietest average; they hold at every torque."
        for between in bank.interpolations
    ]
    return "\n".join(parts)


def _input(model: Model) -> str:
    """Return a sentence on what the model reads."""
    if (bank := model.estimator.template_bank) is not None:
        return _TEMPLATE_INPUT.format(_points_text(bank))
    if CELLS in model.estimator.reads:
        return _POOLED_INPUT + _further_input(model)
    return f"The columns {', '.join(sorted(model.estimator.columns_read))} of the table `features`."


def _further_input(model: Model) -> str:
    """Return a sentence on the further columns that the model reads; empty without any."""
    columns = model.estimator.columns
    if not columns:
        return ""
    functions = "".join(f"; `{title}`, module with SHA-256 `{sha256}`" for title, sha256 in model.added.items())
    return f"\nFurther columns of the table `features`: {', '.join(f'`{name}`' for name in columns)}{functions}."
