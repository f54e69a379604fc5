"""Check the tree of modules: size of folders and files, names of modules, imports through the faces of packages.

Usage: python tests/checks/tree.py [--root FOLDER]

Prints ``path: rule`` for each offence, and ends with 1 if there is any.
"""

import argparse
import ast
import io
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

MOST_MODULES = 12
"""Modules in a folder."""

PLUG_INS = {"cli/commands", "recording/files/formats"}
"""Folders of plug-ins, which hold one module for each."""

MOST_LINES, LEAST_LINES, LEAST_CODE_LINES = 400, 80, 40
"""A file is small if it has fewer lines and fewer code lines than these: documentation makes a file larger too."""

SMALL = {
    "cli/output.py": "the streams that all commands print to",
    "cli/options/format.py": "one option that most commands share",
    "cli/options/names.py": "the type of options with names, which several commands share",
    "cli/options/limits.py": "the options of all commands that query",
    "cli/options/quantities.py": "the type of options that hold a number with a unit",
    "cli/options/workers.py": "the options of all commands that start workers",
    "core/compiled.py": "importing it imports numba",
    "sweep/work/life_rows.py": "the rows of lives, which the design knows nothing of",
    "recognition/idle_cores.py": "training and evaluation use it",
    "recording/evidence/kept_power.py": "imports numba",
    "recognition/laws/explained_squares.py": "importing it imports numba",
    "transmission/system/small_matrices.py": "transmission and dynamics use it",
    "transmission/system/sensitivity.py": "derivatives of a rig, which dynamics and identification use",
    "core/plain_arrays.py": "one check that all packages use",
    "core/progress.py": "types and one function that all packages use",
    "core/streams.py": "the random streams, apart from all that draws",
    "core/version.py": "the build reads it",
    "database/open_tables/check_open_tables.py": "the check of both formats, which sweeps and ingests verify by",
    "database/matching/outside_threshold.py": "one file of a database: its writer and its reader",
    "database/matching/residuals.py": "the quantity that matching compares, used by its index and its search",
    "database/store/seal.py": "the one way in which files are sealed",
    "diagnosis/change/path.py": "the path, which templates and the power use",
    "dynamics/time_profile.py": "a public type of input",
    "ingest/machine_defaults.py": "settings of a database for other recordings, apart from its making",
    "ingest/row_parts.py": "parts of rows, which an ingest makes and a verification makes again",
    "ingest/settings.py": "a section that a database keeps",
    "explorer/panels.py": "the panels of any average: of a view, a row or a recording",
    "explorer/guard.py": "who may ask the server, which a person reads on its own",
    "measurement/settings.py": "a section of a recipe",
    "monitoring/row_facts.py": "the rows of a database, apart from the looks that they make",
    "monitoring/settings.py": "the settings, which the modules of the package use",
    "recording/evidence/least_event.py": "the power of a decision, apart from the decision",
    "recognition/bound/noise_bands.py": "the bands of noise, used by tables and pages",
    "recognition/calibration/unfit_reasons.py": "the verdict that three estimators by templates share",
    "recognition/templates/outward.py": "changes beyond the severities of templates, apart from the tests for them",
    "recognition/calibration/cells.py": "the cells that both kinds of intervals are calibrated in",
    "database/splits/names.py": "names that must not import what uses them",
    "database/store/roles.py": "one table, apart from the schema",
    "recognition/targets/all_targets.py": "the dictionary of targets, above each of them",
    "recognition/targets/detection_tables.py": "tables of one target, apart from its metrics",
    "sweep/plan/members.py": "members of an ensemble, apart from the points that they make",
    "recognition/rows/turned_products.py": "products that laws, templates and fusion use",
    "recognition/templates/compact_signals.py": "one transformation of averages",
    "recording/history.py": "one result of a series of recordings",
    "report/evaluation/style.py": "colours and names of one kind of page",
    "report/evaluation/text.py": "the text of an evaluation, apart from its page",
    "report/settings.py": "a section of a recipe",
    "signature/averaging/sinc_kernel.py": "the kernel of the average, apart from its use",
    "signature/indicators/moment_kernels.py": "functions that three families of indicators use",
    "signature/settings.py": "a section of a recipe",
    "signature/spectrum.py": "functions that indicators and separation use",
    "signature/wigner_ville/lag_products.py": "importing it imports numba",
    "identification/measured_target.py": "what all kinds of measured targets share",
    "transmission/system/compliance.py": "the static counterpart of the modal system",
    "transmission/ensemble/draws.py": "the draws, above rigs, which know only what is assumed of them",
    "transmission/parts/rolling_bearing.py": "a part of a bearing that does not enter the dynamics",
    "transmission/parts/sensors.py": "one kind of part",
}
"""Small files, each with the reason why it stands alone."""

NAMED_OTHERWISE = {
    "identification/search.py": "the search by CMA-ES, which ends in a Minimum",
    "cli/options/workers.py": "options of workers: jobs and scheduler",
    "database/query.py": "statements and conditions of a user",
    "database/signals.py": "blocks of the table of signals",
    "database/summary.py": "the summary of a database: its card as data",
    "dynamics/march/kernel.py": "the compiled steps of the march",
    "measurement/specimen.py": "the law of a specimen: its index errors and its noise",
    "paper/measures.py": "numbers that the claims compare",
    "pipeline/pictures.py": "pictures of rows, rigs and databases",
    "recognition/calibration/conformal.py": "conformal quantiles",
    "recognition/calibration/probabilities.py": "calibrated probabilities",
    "recognition/estimators/contract.py": "the contract of estimators",
    "report/evaluation/page.py": "the page of an evaluation",
    "report/panels.py": "what a panel of a picture shows",
    "report/recording/page.py": "the page of a recording",
    "report/recording/pictures.py": "the pictures of a recording",
    "signature/indicators/average.py": "the indicators of the average, each by its name",
    "signature/separation.py": "separates an average into its regular, residual and difference signals",
    "signature/wigner_ville/distribution.py": "the distribution, in the folder of its name",
    "transmission/library.py": "the library of rigs",
    "transmission/mesh/energy_method.py": "stiffness by the energy method",
    "transmission/parts/bodies.py": "gears and disks as bodies",
    "transmission/parts/supports.py": "bearings and couplings",
    "transmission/summary/parts.py": "the parts of a rig as rows",
    "transmission/summary/summary.py": "the description of a rig as data",
}
"""Modules without a word of their name in any name that they define, each with the reason."""

VAGUE = {"util", "utils", "common", "helper", "helpers", "misc", "tools", "functions", "base", "shared", "stuff"}


def main() -> int:
    """Run the check."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--root", type=Path, default=Path(__file__).parents[2], help="folder with sigdb")
    offences = list(check(parser.parse_args().root / "sigdb"))
    print(*offences, sep="\n")
    return 1 if offences else 0


def check(root: Path) -> Iterator[str]:
    """Offences of the tree below the package's folder."""
    files = sorted(path for path in root.rglob("*.py"))
    modules = [path for path in files if path.name not in ("__init__.py", "__main__.py")]
    yield from _large_folders(root, modules)
    for path in modules:
        name = path.relative_to(root).as_posix()
        yield from (f"sigdb/{name}: {rule}" for rule in _wrong_size(name, path) if rule)
        if {path.stem, path.parent.name} & VAGUE:
            yield f"sigdb/{name}: a vague name"
        elif _is_named_after_its_content(path) == (name in NAMED_OTHERWISE):
            wrong = "no name that it defines has a word of its own name"
            yield f"sigdb/{name}: {'take it out of the table of names' if name in NAMED_OTHERWISE else wrong}"
    for name in sorted({*SMALL, *NAMED_OTHERWISE} - {path.relative_to(root).as_posix() for path in modules}):
        yield f"sigdb/{name}: is in a table of this check, but does not exist"
    for path in files:
        yield from _past_a_face(root, path)


def _large_folders(root: Path, modules: list[Path]) -> Iterator[str]:
    for folder in sorted({path.parent for path in modules}):
        count, name = sum(path.parent == folder for path in modules), folder.relative_to(root).as_posix()
        if count > MOST_MODULES and name not in PLUG_INS:
            yield f"sigdb/{name}: {count} modules, at most {MOST_MODULES}"


def _wrong_size(name: str, path: Path) -> Iterator[str]:
    source = path.read_text(encoding="utf-8")
    lines = len(source.splitlines())
    if lines > MOST_LINES:
        yield f"{lines} lines, at most {MOST_LINES}"
    code = code_lines(source) if lines < LEAST_LINES else LEAST_CODE_LINES
    small = code < LEAST_CODE_LINES
    if small and Path(name).parent.as_posix() not in PLUG_INS and name not in SMALL:
        yield f"{code} code lines: join its neighbour, or give a reason in the table of small files"
    if not small and name in SMALL:
        yield "is not small: take it out of the table of small files"


def code_lines(source: str) -> int:
    """Count the lines with code: no blank lines, comments or docstrings."""
    documentation: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            documentation |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    skipped = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in skipped:
            code |= set(range(token.start[0], token.end[0] + 1))
    return len(code - documentation)


def _is_named_after_its_content(path: Path) -> bool:
    """Whether a word of a module's name occurs in a name that it defines or in a method of its classes."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = " ".join(_defined(tree)).lower()
    return any(_stem(word) in names for word in path.stem.strip("_").split("_"))


def _stem(word: str) -> str:
    """The beginning of a word, which its noun, its verb and its plural share."""
    return word.removesuffix("s")[: max(4, len(word) - 4)]


def _defined(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.AnnAssign(target=ast.Name(id=name)):
                yield name
            case ast.Assign(targets=targets):
                yield from (target.id for target in targets if isinstance(target, ast.Name))


def _past_a_face(root: Path, path: Path) -> Iterator[str]:
    """Imports of another package's inside, for types too."""
    relative = path.relative_to(root)
    own = relative.parts[0] if len(relative.parts) > 1 else ""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [str(node.module)]
        for name in names:
            parts = name.split(".")
            command = relative.as_posix() in ("sweep/__main__.py", "__main__.py")
            if parts[0] == "sigdb" and len(parts) > 2 and parts[1] != own and not command:
                yield f"sigdb/{relative.as_posix()}:{node.lineno}: imports {name}, past the face of sigdb.{parts[1]}"


if __name__ == "__main__":
    sys.exit(main())
