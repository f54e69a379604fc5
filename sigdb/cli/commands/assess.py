"""``sigdb assess``."""

import sys

import click

from sigdb.cli.options.format import format_option
from sigdb.cli.options.places import DATABASE
from sigdb.cli.rows import write_rows


@click.command()
@click.argument("model")
@click.argument("database", metavar="DB", type=DATABASE)
@click.option("--where", help="Only rows that meet this SQL condition, for example 'snr_db > -10'.")
@click.option(
    "--prevalence",
    type=float,
    help="Share of the gears that are damaged; by default that of the training. A detector then calls damage by its "
    "probability, and otherwise at its rate of false alarms.",
)
@click.option("--false-alarm-cost", type=float, help="Cost of calling a healthy gear damaged; 1 by default.")
@click.option("--miss-cost", type=float, help="Cost of calling a damaged gear healthy; 1 by default.")
@click.option("--wrong-tooth-cost", type=float, help="Cost of naming a tooth that is not damaged; 1 by default.")
@format_option("table", "csv", "json", of="the answers")
def assess(
    model: str,
    database: str,
    where: str | None,
    prevalence: float | None,
    false_alarm_cost: float | None,
    miss_cost: float | None,
    wrong_tooth_cost: float | None,
    form: str,
) -> None:
    """Answer rows of a database, simulated or of recordings, by a trained model.

    MODEL is the folder of a model, or the name of a reference model. Each row gets the verdict: what stands out, or why
    it cannot be judged, with the probability, the answers that cannot be ruled out and the decision. The decision is
    the answer of least expected cost by the prevalence and the costs.

    \b
    Example:
      sigdb assess data/quick/location data/quick/signatures --where "id < 5" --prevalence 0.01 --miss-cost 50
    """
    import pandas as pd
    import pyarrow as pa

    from sigdb.database import open as open_database
    from sigdb.pipeline import assess_rows
    from sigdb.recognition import Costs, load_model

    costs = {"false_alarm": false_alarm_cost, "miss": miss_cost, "wrong_tooth": wrong_tooth_cost}
    stated = {name: value for name, value in costs.items() if value is not None}
    answers = assess_rows(
        load_model(model),
        open_database(database),
        where=where,
        prevalence=prevalence,
        costs=Costs(**stated) if stated else None,
    )
    table = pa.Table.from_pandas(pd.concat(answers).reset_index(), preserve_index=False)
    write_rows(table.to_reader(), form, sys.stdout.buffer)
