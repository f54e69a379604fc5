"""Files of an identification: its rigs, its tables as JSON, and a summary in Markdown."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

from sigdb.core import json_text, markdown_table, publish_all
from sigdb.identification.identification import MET, NOT_IDENTIFIED, Identification

if TYPE_CHECKING:
    import pandas as pd

RIGS = "members"
"""Folder of the rig files."""


def write_identification(result: Identification, folder: str | os.PathLike[str]) -> list[Path]:
    """Write a rig file for each member, ``identification.json`` and ``identification.md``, in place of former ones.

    Parameters
    ----------
    result : Identification
        The result.
    folder : str or path
        The folder; it is made if there is none.

    Returns
    -------
    list of Path
        The JSON document, the summary, then the rig files.
    """
    folder = Path(folder)
    (folder / RIGS).mkdir(parents=True, exist_ok=True)
    for former in (folder / RIGS).glob(f"{result.problem.rig.name}-*.toml"):
        former.unlink()
    digits = len(str(len(result.members)))
    contents = {
        folder / "identification.json": json_text(result.as_json()),
        folder / "identification.md": identification_markdown(result),
    }
    for number, rig in enumerate(result.rigs):
        contents[folder / RIGS / f"{rig.name}-{number:0{digits}d}.toml"] = rig.to_toml()
    publish_all(contents)
    return list(contents)


def identification_markdown(result: Identification) -> str:
    """Return a summary in Markdown: the fit, the posterior with the prior, and predictions with bands."""
    posterior, predictions = result.posterior(), result.predictions()
    observations = result.observations()
    percent = f"{100 * result.level:.0f} %"
    parts = [
        f"# Identification of {result.problem.rig.name}",
        *([result.problem.targets.title] if result.problem.targets.title else []),
        "\n".join(identification_sentences(result)),
        f"## Numbers: their ranges, and intervals of {percent}",
        _table(posterior),
        *(
            [f"## Measured numbers, and what the rigs predict: intervals of {percent}", _table(predictions)]
            if len(predictions)
            else []
        ),
        *([f"## Observations: intervals of {percent}", _table(observations)] if len(observations) else []),
    ]
    return "\n\n".join(parts) + "\n"


def identification_sentences(result: Identification) -> list[str]:
    """Return sentences on the fit, on what was left out, and on the numbers that the targets do not identify."""
    posterior, met = result.posterior(), sum(result.meets_targets)
    unidentified = list(posterior.index[~posterior["is_identified"]])
    sentences = [
        f"{met} of {len(result.members)} rigs meet the targets: the mean square of their misses is at most {MET:g} "
        "in standard deviations, and their observations hold.",
        *(f"{count} draws were left out: {reason}." for reason, count in result.left_out.items()),
    ]
    if unidentified:
        sentences.append(
            f"The targets do not identify {', '.join(unidentified)}: there the interval is wider than "
            f"{NOT_IDENTIFIED:g} times that of the range."
        )
    if met < len(result.members):
        sentences.append(
            "Rigs that miss the targets mean that no rig of these ranges meets them, that a target is wrong, or that "
            "a mode was taken for another; compare the stated and predicted numbers below."
        )
    return sentences


def _table(frame: "pd.DataFrame") -> str:
    plain = frame.reset_index()
    head = [name.replace("_", " ") for name in plain.columns]
    return markdown_table(head, [[_cell(value) for value in row] for row in plain.itertuples(index=False)])


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    return {True: "yes", False: "no"}[bool(value)] if not isinstance(value, str) else value
