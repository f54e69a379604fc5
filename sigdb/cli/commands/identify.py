"""``sigdb identify``."""

from pathlib import Path

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import RIG, ExistingPath


@click.command()
@click.argument("rig", type=RIG)
@click.argument("targets", type=ExistingPath())
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    help="Folder for the rig files, the page, the tables and what is needed to go on.",
)
@click.option("--members", type=click.IntRange(2), default=39, show_default=True, help="Number of rigs.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the draws.")
@click.option(
    "--evaluations",
    type=click.IntRange(1),
    default=1000,
    show_default=True,
    help="Most rigs tried for each member, where observations or choices need CMA-ES.",
)
@format_option("markdown", "json")
def identify(rig: str, targets: Path, out: Path, members: int, seed: int, evaluations: int, form: str) -> None:
    """Search in the ranges of a rig for the rigs that meet stated targets.

    RIG is the name of a built-in rig or a TOML file, with ranges of what is assumed. TARGETS is a TOML file with
    measured natural frequencies, damping ratios, static deflections, mesh harmonics or levels in a run-up, each with
    its error, and with observations: an indicator of a damaged gear that is below or above a bound.

    The result is an ensemble: intervals of each number, which numbers the targets do not identify, and predictions of
    what was held out. The command may be stopped at any instant; repeated, it goes on.

    \b
    Example:
      sigdb identify my_rig.toml targets.toml --out data/identified
    """
    from sigdb.cli.progress import show_progress
    from sigdb.identification import identification_markdown, write_identification
    from sigdb.identification import identify as identify_rigs
    from sigdb.report import write_identification_report

    with show_progress() as on_progress:
        result = identify_rigs(
            rig, targets, members=members, seed=seed, evaluations=evaluations, folder=out, on_progress=on_progress
        )
    write_identification(result, out)
    write_identification_report(result, out)
    if form == "json":
        echo_json(result.as_json())
    else:
        click.echo(identification_markdown(result), nl=False)
