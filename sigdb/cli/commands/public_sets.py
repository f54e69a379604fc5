"""``sigdb public-sets``."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sigdb.cli.main import ExitCode
from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.workers import jobs_option

if TYPE_CHECKING:
    from sigdb.public_sets import FolderCheck, PublicSet, SetResults


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option(
    "--folder", type=click.Path(path_type=Path), help="Folder into which the one named set was downloaded: check it."
)
@click.option("--out", metavar="DB", help="Ingest the recordings of the folder into this database.")
@click.option(
    "--results",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Evaluate the database, and write the results to this JSON file.",
)
@click.option(
    "--diagnoses",
    type=click.IntRange(min=0),
    default=4,
    show_default=True,
    help="Greatest number of recordings that the evaluation diagnoses, each channel against healthy ones of the set: "
    "half a minute each.",
)
@click.option("--teeth", metavar="COUNTS", help="Tooth counts, where no cited page states them, or in their place.")
@click.option("--sampling-rate", type=float, help="Sampling rate, Hz, where no cited page states it.")
@click.option("--ratio", help="Revolutions of the averaged shaft in one of the tacho's, where no page states it.")
@click.option("--speed-rpm", type=float, help="Speed of the averaged shaft within 5 %, where no page states it.")
@jobs_option
@format_option("table", "json", of="the sets")
def public_sets(
    names: tuple[str, ...],
    folder: Path | None,
    out: str | None,
    results: Path | None,
    diagnoses: int,
    teeth: str | None,
    sampling_rate: float | None,
    ratio: str | None,
    speed_rpm: float | None,
    jobs: int,
    form: str,
) -> int:
    """Show what cited pages state of public sets, and make a database of a set that you have downloaded.

    Without a name all sets are listed. With --folder the folder of one set is checked: which recordings it holds, what
    is missing, and which files differ from those published. --out ingests the recordings, --results evaluates them
    against the right answers. sigdb downloads nothing. The exit code is 1 if something is missing or has changed.

    \b
    Example:
      sigdb public-sets spectraquest
    """
    from sigdb.core import InputError
    from sigdb.public_sets import check_folder, load_public_set, public_set_names

    if folder is None:
        if out is not None or results is not None:
            raise InputError("--out and --results need --folder, the folder of the set")
        described = {name: load_public_set(name) for name in names or public_set_names()}
        if form == "json":
            echo_json({name: each.model_dump(exclude_none=True) for name, each in described.items()})
        elif names:
            click.echo("\n\n".join(_card(name, each) for name, each in described.items()))
        else:
            click.echo("\n".join(f"{name:<14} {each.title}" for name, each in described.items()))
        return ExitCode.DONE
    if len(names) != 1:
        raise InputError(
            f"--folder is of one set, and {len(names)} are named; name one of {', '.join(public_set_names())}"
        )
    if results is not None and out is None:
        raise InputError("--results needs --out, the database to evaluate")
    public_set = load_public_set(names[0])
    if public_set.warning:
        click.echo(f"sigdb: {public_set.warning}", err=True)
    check = check_folder(names[0], public_set, folder)
    reading = {"sampling_rate": sampling_rate, "ratio": ratio}
    settings: dict[str, Any] = {} if teeth is None else {"teeth": teeth}
    if stated := {name: value for name, value in reading.items() if value is not None}:
        settings["reading"] = stated
    if speed_rpm is not None:
        settings["averaging"] = {"speed_rpm": speed_rpm}
    if out is not None:
        _ingest(public_set, check, out, settings, jobs)
    evaluated = None
    if results is not None and out is not None:
        evaluated = _evaluate(public_set, check, out, settings, diagnoses, results)
    if form == "json":
        echo_json(_facts(check) if evaluated is None else evaluated.as_json())
    else:
        _print_check(public_set, check)
        if evaluated is not None:
            _print_results(evaluated)
    return ExitCode.WRONG if check.missing or check.changed else ExitCode.DONE


def _ingest(public_set: "PublicSet", check: "FolderCheck", out: str, settings: dict[str, Any], jobs: int) -> None:
    from sigdb.cli.progress import show_progress
    from sigdb.public_sets import ingest_set

    with show_progress() as on_progress:
        done = ingest_set(public_set, check, out, settings=settings, jobs=jobs, on_progress=on_progress)
    click.echo(f"{out}: {done.rows} rows of {done.recordings} recordings, {done.failed} without a result", err=True)


def _evaluate(
    public_set: "PublicSet", check: "FolderCheck", out: str, settings: dict[str, Any], diagnoses: int, file: Path
) -> "SetResults":
    from sigdb.core import json_text, publish
    from sigdb.public_sets import evaluate_set

    evaluated = evaluate_set(
        public_set,
        check,
        out,
        diagnoses=diagnoses,
        settings=settings,
        on_step=lambda step: click.echo(f"diagnosing {step}", err=True),
    )
    publish(file, json_text(evaluated.as_json()).encode())
    return evaluated


def _card(name: str, public_set: "PublicSet") -> str:
    """Return what pages state of a set, each statement with its source."""
    keys = list(public_set.sources)
    lines = [f"{name}: {public_set.title}"]
    for label in ("where", "licence", "gears", "labels", "answer"):
        statement = getattr(public_set, label)
        text = (
            "no page could be cited" if statement is None else f"{statement.text} [{keys.index(statement.source) + 1}]"
        )
        lines.append(f"  {label:<8} {text}")
    for files in public_set.files:
        kind = "recordings" if files.recording else "no raw recordings, not ingested"
        count = f", {files.least} in the complete set" if files.least > 1 else ""
        lines.append(f"  files    {files.pattern} ({kind}{count}) [{keys.index(files.source) + 1}]")
    if not public_set.files:
        lines.append("  files    no page could be cited")
    lines += [f"  give     --{need.replace('_', '-')}: no cited page states it" for need in public_set.needs]
    lines += [f"  not cited: {text}" for text in public_set.not_cited]
    lines += [f"  [{number}] {each.title}, {each.url}" for number, each in enumerate(public_set.sources.values(), 1)]
    lines.append(f"  tried on {public_set.tried}" if public_set.tried else f"  {public_set.warning}")
    return "\n".join(lines)


def _facts(check: "FolderCheck") -> dict[str, Any]:
    lists = {name: list(getattr(check, name)) for name in ("missing", "changed", "unknown", "others")}
    return {"set": check.name, "recordings": [facts.file for facts in check.recordings]} | lists


def _print_check(public_set: "PublicSet", check: "FolderCheck") -> None:
    click.echo(f"{check.folder}: {len(check.recordings)} recordings of {public_set.title}")
    for text in check.missing:
        click.echo(f"missing: {text}; {public_set.where.text}")
    for name in check.changed:
        click.echo(f"changed: {name} is not the published file: its SHA-256 is another one")
    if check.others:
        click.echo(
            f"{len(check.others)} files of the set are no raw recordings and are not ingested, first {check.others[0]}"
        )
    if check.unknown:
        click.echo(f"{len(check.unknown)} files are left out, first {check.unknown[0]}: no pattern of the set fits")


def _print_results(evaluated: "SetResults") -> None:
    for row in evaluated.rows:
        click.echo(f"{row['rows']} rows, state {row['state']}: {row['status_code']}")
    best = sorted(evaluated.indicators, key=lambda each: -abs(each["area"] - 0.5))[:3]
    for each in best:
        click.echo(
            f"{each['indicator']} by {each['sensor']}: area {each['area']:.2f} of {each['damaged']} damaged against "
            f"{each['healthy']} healthy recordings, by the labels of the set"
        )
    counts = ", ".join(f"{count} {verdict}" for verdict, count in evaluated.verdicts.items()) or "none"
    click.echo(f"answers of diagnoses: {counts}")
