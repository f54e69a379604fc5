"""One answer of each machine from the averages that trained models read: several sensors, points and recordings."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import pandas as pd
from scipy.special import log_softmax, logsumexp
from scipy.stats import binom

from sigdb.core import Answer, FloatArray, InputError, NotApplicableError
from sigdb.recognition.answers import NO_TEMPLATE_FITS
from sigdb.recognition.calibration.conformal import COVERED
from sigdb.recognition.fusion.bank_laws import BankLaws
from sigdb.recognition.fusion.joint_law import JointLaw
from sigdb.recognition.model import Model
from sigdb.recognition.rows.batch import NOISE, POINT, TSA, Batch
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.continuous_severity import ContinuousSeverity, SeverityMarginals
from sigdb.recognition.templates.posterior import Posterior, posterior, quantity_posterior
from sigdb.recognition.templates.severity_grid import severity_grids

CREDIBILITY = 0.9
"""Probability that the candidates of a fused answer hold together, and that of the intervals of severity."""

_ENDS = {"": 0.5, "_low": (1 - CREDIBILITY) / 2, "_high": (1 + CREDIBILITY) / 2}
"""Quantiles of a severity that are answered, by the ends of their names."""

Part: TypeAlias = tuple[Model, pd.DataFrame]
"""A model, and the rows that it reads."""


def fuse_models(parts: Sequence[Part], *, machine: str = "machine") -> pd.DataFrame:
    """Return one answer of each machine, from all rows that models read of it.

    Each model reads the averages of one sensor at any number of operating points and recordings. Averages have
    independent noise and common index errors, by the templates of the models (:class:`JointLaw`). Before averages are
    seen, damage and none are equally likely, and so are all teeth; templates have their shares in the training. Where
    all models hold between their severities, these are continuous, as in :class:`TemplateScores`.

    Parameters
    ----------
    parts
        Models with banks of templates, and rows for each as of :meth:`Model.predict`, with the averages ``tsa``.
    machine
        Column of the rows that names their machine. Averages of one machine have a common tacho mark.

    Returns
    -------
    pandas.DataFrame
        A row for each machine, with the columns:

        - ``kind`` and ``answer``: as of :meth:`Model.assess`, from the candidates;
        - ``outside``, ``reason``: whether a row of the machine is outside what its model was trained for, or more rows
          than usual fit no template, and why;
        - ``averages``: number of averages;
        - ``tooth``, ``probability``: the most probable tooth, 0 for none, and its probability;
        - ``candidates``: the most probable teeth that have the probability 0.9 together, 0 for none;
        - ``log_odds``: logarithm of P(damage) / P(none);
        - for each severity ``QUANTITY``, ``QUANTITY_low`` and ``QUANTITY_high``: its median given damage, and the
          interval that holds 0.9 of it.

    Raises
    ------
    InputError
        If rows have no machine, or averages of one machine are of gears of different tooth counts.
    NotApplicableError
        If a model has no templates.

    Examples
    --------
    Two sensors of each recording::

        fuse_models([(first, rows_of_first), (second, rows_of_second)], machine="serial_number")
    """
    readers = [_with_templates(model) for model, _ in parts]
    banks = [bank for _, bank in readers]
    laws = [BankLaws(bank) for bank in banks]
    rows = [_readable(readers[number][0], table, machine, number) for number, (_, table) in enumerate(parts)]
    together = pd.concat(rows)
    answers = {
        name: _answer(of_machine, laws, [bank.index_error for bank in banks])
        for name, of_machine in together.groupby(machine, sort=False)
    }
    return pd.DataFrame.from_dict(answers, orient="index").rename_axis(machine)


def _with_templates(model: Model) -> tuple[Model, TemplateBank]:
    """Return a model whose estimator has a bank of templates, and the bank.

    Raises
    ------
    NotApplicableError
        If no estimator of the model has templates.
    """
    for name in (model.learner, *model.estimators):
        bank = model.estimators[name].template_bank
        if bank is not None:
            return replace(model, learner=name), bank
    raise NotApplicableError(
        f"the model of {model.target} has no templates, whose law joins averages; train one on a database with "
        "templates"
    )


def _readable(model: Model, table: pd.DataFrame, machine: str, part: int) -> pd.DataFrame:
    """Return the columns of rows that are read, with ``part`` and the reason why each is outside, or none."""
    lacking = [name for name in (machine, *POINT, *NOISE, TSA) if name not in table]
    if lacking:
        raise InputError(f"the rows lack the columns {', '.join(lacking)}; give averages with their machines")
    reasons = model.assess(table.drop(columns=machine))["reason"].to_numpy()
    noise = Batch(table=table[list(NOISE)]).noise()
    return table[[machine, *POINT, TSA]].assign(noise=noise, part=part, reason=reasons)


def _answer(rows: pd.DataFrame, laws: Sequence[BankLaws], sizes: Sequence[float]) -> dict[str, object]:
    """Return the answer to one machine."""
    reason = _reason(rows["reason"].tolist())
    facts: dict[str, object] = {"outside": bool(reason), "reason": reason, "averages": len(rows)}
    if reason:
        return _sentence(Answer.of("cannot be judged", reason=reason)) | facts | {"candidates": ()}
    points = rows[list(POINT)].itertuples(index=False, name=None)
    of_rows = [laws[part].at(*point) for part, point in zip(rows["part"], points, strict=True)]
    joint = JointLaw.of(of_rows)
    share = laws[int(rows["part"].iloc[0])].share(joint.teeth, joint.keys)
    with np.errstate(divide="ignore"):
        prior = np.repeat(np.log(share / (2 * joint.teeth))[:, None], joint.teeth, axis=1)
    averages = [np.asarray(x, float)[None] for x in rows[TSA]]
    index_error = np.array([sizes[part] for part in rows["part"]])
    law = {"noise": rows["noise"].to_numpy(), "index_error": index_error}
    likelihood = joint.log_likelihood(averages, **law)
    between = _between(joint, share, [laws[part] for part in rows["part"].unique()])
    if between is None:
        after = posterior(likelihood, prior, joint.healthy)
        severity = _severity(after, joint)
    else:
        distances = [joint.distances(templates, **law)[None] for templates in between.templates]
        ((_, evidence, marginals),) = between.marginals(likelihood, distances)
        none = logsumexp(likelihood[:, joint.healthy] + prior[joint.healthy], axis=(1, 2))
        location = np.column_stack([none, evidence - np.log(2 * joint.teeth)])
        after = Posterior(location=log_softmax(location, axis=1), damage=np.empty((1, 0)))
        severity = _severity_between(marginals, joint)
    share_of_teeth = np.exp(after.location[0])
    candidates = credible_set(share_of_teeth)
    tooth = int(after.tooth[0])
    numbers: dict[str, object] = {"tooth": tooth, "probability": share_of_teeth[tooth], "candidates": candidates}
    numbers |= {"log_odds": float(after.log_odds[0])} | severity
    return _sentence(Answer.of_teeth(candidates)) | facts | numbers


def _between(joint: JointLaw, share: FloatArray, laws: Sequence[BankLaws]) -> ContinuousSeverity | None:
    """Return posteriors over severities between the templates; None where a model has those of the templates alone."""
    if not all(law.has_continuous_severity(joint.teeth) for law in laws):
        return None
    grids = severity_grids(joint.severity, joint.healthy)
    return ContinuousSeverity(grids, joint.healthy, share) if grids else None


def _sentence(answer: Answer) -> dict[str, object]:
    return {"kind": answer.kind, "answer": answer.sentence}


def _reason(reasons: Sequence[str]) -> str:
    """Return why a machine is outside, or nothing.

    One average in a hundred of the training fits no template either, so that among many some may.
    """
    unfit = [text for text in reasons if text.startswith(NO_TEMPLATE_FITS)]
    beyond = next((text for text in reasons if text and not text.startswith(NO_TEMPLATE_FITS)), "")
    usual = binom.ppf(COVERED, len(reasons), 1 - COVERED)
    return beyond or (NO_TEMPLATE_FITS if len(unfit) > usual else "")


def credible_set(probabilities: FloatArray) -> tuple[int, ...]:
    """Return the most probable answers that hold :data:`CREDIBILITY` together, in rising order.

    Examples
    --------
    >>> import numpy as np
    >>> credible_set(np.array([0.05, 0.15, 0.8]))
    (1, 2)
    """
    order = np.argsort(-probabilities, kind="stable")
    enough = int(np.searchsorted(np.cumsum(probabilities[order]), CREDIBILITY * probabilities.sum())) + 1
    return tuple(sorted(order[:enough].tolist()))


def _severity(after: Posterior, joint: JointLaw) -> dict[str, float]:
    """Return median and interval of each severity; templates with a pattern have none, and do not take part."""
    parts = [quantity_posterior(after, level) for level in joint.severity.T]
    named = zip(joint.laws[0].quantities, parts, strict=True)
    return {f"{name}{end}": float(part.quantile(p)[0]) for name, part in named for end, p in _ENDS.items()}


def _severity_between(marginals: SeverityMarginals, joint: JointLaw) -> dict[str, float]:
    """Return the same of a posterior over severities between the templates."""
    quantiles, names = {end: marginals.quantile(p)[0] for end, p in _ENDS.items()}, joint.laws[0].quantities
    return {f"{name}{end}": float(quantiles[end][i]) for i, name in enumerate(names) for end in _ENDS}
