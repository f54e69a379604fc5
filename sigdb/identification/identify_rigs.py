"""The search for the rigs that meet stated targets."""

from collections.abc import Callable
from functools import partial
from os import PathLike
from pathlib import Path

import numpy as np

from sigdb.core import InputError, OnProgress, Progress, ignore
from sigdb.identification.identification import Identification, Member
from sigdb.identification.optimum import Linearised, drawn_member, optima
from sigdb.identification.problem import Problem, check_free
from sigdb.identification.search_record import SearchRecord
from sigdb.identification.targets import Targets, load_targets
from sigdb.transmission import Transmission, as_transmission, small_matrices

MEMBERS = 39
"""Usual number of members: the least and the greatest of 39 enclose 95 % of the probability."""
EVALUATIONS = 1000
"""Usual number of rigs that a search without derivatives tries for a member."""
_MOST_TRIES = 4
"""Draws for each member: some give rigs that cannot be."""


@small_matrices
def identify(
    rig: Transmission | str | PathLike[str],
    targets: Targets | str | PathLike[str],
    *,
    members: int = MEMBERS,
    seed: int = 0,
    evaluations: int = EVALUATIONS,
    folder: str | PathLike[str] | None = None,
    on_progress: OnProgress = ignore,
) -> Identification:
    """Search in the ranges of a rig for the rigs that meet stated targets.

    The members are draws of the posterior by randomised maximum likelihood: each fits the targets with errors of its
    own, from a draw of its own from the ranges. The search is by least squares, or by CMA-ES where there are
    observations or free choices. Rigs that cannot be are left out, as in :func:`sigdb.ensemble`.

    Parameters
    ----------
    rig : Transmission, str or path
        A rig with assumed numbers that have ranges, the name of a built-in one, or a rig file.
    targets : Targets, str or path
        Its measurements with their errors, or the TOML file that states them.
    members : int
        Number of rigs.
    seed : int
        Seed of the draws; the same seed gives the same rigs, and member k does not depend on their number.
    evaluations : int
        Greatest number of rigs that are tried for each member, where CMA-ES searches: with observations, or choices.
    folder : str or path, optional
        Folder that keeps what is finished: the same call goes on there, with the same result.
    on_progress : callable
        Called with the number of finished members.

    Returns
    -------
    Identification

    Raises
    ------
    TypeError
        If the rig is of another type.
    InputError
        If a target does not fit the rig, nothing of the rig is free, the folder holds another search, or
        too few draws can be rigs.

    Examples
    --------
    >>> from pathlib import Path
    >>> import sigdb
    >>> from sigdb.identification import Targets, identify
    >>> text = sigdb.load_transmission("friswell-5.9.1").to_toml()
    >>> text = text.replace("stiffness.2", "stiffness.1").replace("low = 10000000.0", "low = 5e5")
    >>> text = text.replace("high = 1000000000.0", "high = 2e6")
    >>> _ = Path("rotor.toml").write_text(text)
    >>> targets = Targets(modes=[{"frequency_hz": 13.590, "relative_error": 0.01}])
    >>> identify("rotor.toml", targets, members=2)
    <Identification of 'friswell-5.9.1': 2 rigs, 2 of which meet the targets>
    """
    rig = as_transmission(rig)
    targets = targets if isinstance(targets, Targets) else load_targets(targets)
    if isinstance(members, bool) or not isinstance(members, int) or members < 2:
        raise InputError(f"members = {members!r} must be a whole number, 2 or more")
    check_free(rig)
    targets.check(rig)
    problem = Problem(rig, targets)
    inputs = {"rig": rig.model_dump(mode="json"), "targets": targets.model_dump(mode="json"), "seed": seed}
    if not problem.is_smooth:
        inputs["evaluations"] = evaluations
    record = SearchRecord(Path(folder) if folder is not None else None, inputs)
    near = _optima(problem, record, seed) if problem.is_smooth else []
    search = partial(_member, problem, near, seed, evaluations)
    return _ensemble(problem, search, record, members, on_progress)


def _optima(problem: Problem, record: SearchRecord, seed: int) -> list[Linearised]:
    """Return the problem near the most probable rigs."""
    parts = record.part("optima", lambda: optima(problem, np.random.default_rng([seed, 0])))
    return [Linearised(**{name: np.array(value, float) for name, value in part.items()}) for part in parts]


def _ensemble(
    problem: Problem,
    search: Callable[[int], dict[str, object]],
    record: SearchRecord,
    members: int,
    on_progress: OnProgress,
) -> Identification:
    done: list[Member] = []
    left_out: dict[str, int] = {}
    before = min(sum(name.startswith("member") for name in record.names), members)
    for number in range(_MOST_TRIES * members):
        part = record.part(f"member {number}", partial(search, number))
        if part["reason"] is not None:
            left_out[part["reason"]] = left_out.get(part["reason"], 0) + 1
            continue
        arrays = {name: np.array(part[name], float) for name in ("z", "predicted", "observed")}
        done.append(Member(rig=problem.rig_at(arrays["z"]), misfit=part["misfit"], **arrays))
        on_progress(Progress(stage="members", done=len(done), total=members, before=before))
        if len(done) == members:
            return Identification(problem=problem, members=tuple(done), left_out=left_out)
    counts = ", ".join(f"{count} {reason}" for reason, count in left_out.items())
    raise InputError(
        f"rig {problem.rig.name!r}: of {_MOST_TRIES * members} draws only {len(done)} can be rigs ({counts}); narrow "
        "what is assumed of it, or look for a target that contradicts the others"
    )


def _member(problem: Problem, near: list[Linearised], seed: int, evaluations: int, number: int) -> dict[str, object]:
    """Return a member as its record has it."""
    end = drawn_member(problem, near, np.random.default_rng([seed, 1, number]), evaluations)
    predicted, observed = problem.predicted(end.z), problem.observed(end.z)
    reason = problem.why_impossible(end.z)
    return {"z": end.z, "misfit": end.misfit, "predicted": predicted, "observed": observed, "reason": reason}
