"""A model against the best possible answer, and its aims, as text for tables."""

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from sigdb.recognition.bootstrap import Figure
from sigdb.recognition.evaluation import Evaluation
from sigdb.recognition.noise_bands import ALL

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
    one = Figure(**{end: row[f"{name}{column}"] for end, column in _ENDS.items()})
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
    value = "beyond" if np.isinf(row["found"]) else str(Figure(value=row["found"], low=row["low"], high=row["high"]))
    return f"{value} ({row['where']})" if row["where"] not in ("", ALL) else value


def _met(met: Any) -> str:
    return "not judged" if pd.isna(met) else "yes" if met else "no"


def _sentence(why: str) -> str:
    return why[:1].upper() + why[1:].rstrip(".") + "." if why else ""
