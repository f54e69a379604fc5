"""Refinement: cases are appended to a database where its templates represent those between them badly."""

from dataclasses import dataclass
from os import PathLike

from sigdb.core import InputError, OnProgress, ignore
from sigdb.database import Database, Store, read_manifest, write_coverage
from sigdb.sweep.density.coverage import USUAL_MATCH, Coverage, summarize
from sigdb.sweep.density.extension import extension
from sigdb.sweep.density.study import study
from sigdb.sweep.plan.make_plan import plan_from
from sigdb.sweep.work.describe_database import check_version
from sigdb.sweep.work.engines import Cluster, Engine, Processes
from sigdb.sweep.work.ownership import ownership_of
from sigdb.sweep.work.run import append, run_parts


@dataclass(frozen=True, kw_only=True)
class Refinement:
    """Result of :func:`refine`.

    Attributes
    ----------
    reached : bool
        Whether every case of the last study reached the requested match.
    rounds : int
        Number of times that cases were appended.
    cases, rows : int
        Number of damaged cases, and of rows, that were appended.
    coverage : Coverage
        The last study, of the database as it is now; its threshold is stored.
    """

    reached: bool
    rounds: int
    cases: int
    rows: int
    coverage: Coverage


def refine(
    location: str | PathLike[str],
    *,
    match: float = USUAL_MATCH,
    cases: int = 200,
    rounds: int = 10,
    sensor: str | None = None,
    jobs: int = -1,
    scheduler: str | None = None,
    on_progress: OnProgress = ignore,
) -> Refinement:
    """Append cases to a database until random cases between its own match its templates.

    In each round about ``cases`` cases are drawn between those that the database was begun with. The case with the
    worst match is appended if its match is below ``match``, then the worst of those that do not match that case either,
    and so on. Each has its measurements, and every tooth, specimen and noise draw of the database. When all cases of a
    round match, nothing more is appended. Existing parts stay as they are. An extension begins with the next part, so
    that ids have a gap before it, and its specimens are the same gear pairs.

    After a stop at any instant, the same call goes on, and so does the sweep that began the database: an unfinished
    extension is finished first. Another call may have another match or other cases.

    Cases are random, so the match is reached for most other cases, not for all. Where n cases all match, fewer than
    3 in n others do not, at 95 % confidence [1]_.

    Parameters
    ----------
    location : str or path-like
        A database. If its own sweep is not finished, that is done first.
    match : float
        Least normalised overlap, between 0 and 1.
    cases : int
        Approximate number of cases of a round.
    rounds : int
        Greatest number of times that cases are appended in this call.
    sensor : str, optional
        Name of the stored sensor whose signatures are compared; the first sensor if left out.
    jobs : int
        Number of worker processes; -1 for one on each core.
    scheduler : str, optional
        Address of a Dask scheduler whose workers make the parts. Cases of a round are simulated on this machine.
    on_progress : callable
        Called with a :class:`sigdb.core.Progress` whenever something is finished.

    Returns
    -------
    Refinement
        Whether the match was reached, how much was appended, and the last study.

    Raises
    ------
    InputError
        If ``match`` is not between 0 and 1, there is no database, or nothing lies between its cases.
    DatabaseError
        If another sweep is running on it, it is damaged, or none of its templates has a result.

    References
    ----------
    .. [1] J. A. Hanley, A. Lippman-Hand, "If nothing goes wrong, is everything all right? Interpreting zero
           numerators", JAMA 249 (1983) 1743-1745, doi:10.1001/jama.1983.03330370053031.
    """
    if not 0 < match < 1:
        raise InputError(f"match = {match:g} must lie between 0 and 1; {USUAL_MATCH} is usual")
    if rounds < 1:
        raise InputError(f"rounds = {rounds} must be 1 or more: the greatest number of times that cases are appended")
    store, engine = Store.at(location), Cluster(scheduler) if scheduler else Processes(jobs)
    read_manifest(store)  # a place without a database is left untouched
    with ownership_of(store):
        store.clear_temporary()
        check_version(store, read_manifest(store).sigdb_version)
        _finish(store, engine, on_progress)
        done = new_cases = new_rows = 0
        while True:
            database = Database(store)
            # The seed moves on with each extension, so that a round that is done again draws the same cases.
            last = study(database, cases=cases, sensor=sensor, seed=None, jobs=jobs, on_progress=on_progress)
            reached = bool((last.cases["match"] >= match).all())
            if reached or done == rounds:
                break
            plan = extension(database.manifest, last, match)
            append(plan, store)
            _finish(store, engine, on_progress)
            done, new_rows = done + 1, new_rows + plan.rows
            new_cases += plan.n_templates - len(plan.rig_points)
        measured = summarize(last)
        write_coverage(store, measured.record)
    return Refinement(reached=reached, rounds=done, cases=new_cases, rows=new_rows, coverage=measured)


def _finish(store: Store, engine: Engine, on_progress: OnProgress) -> None:
    """Make the missing parts of the database and its extensions."""
    plans = [plan_from(plan.resolved) for plan in read_manifest(store).plans]
    run_parts(plans, store, engine, on_progress)
