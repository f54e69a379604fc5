"""A model's card, and the table of figures that evaluation prints."""

from sigdb.recognition.learners import LEARNERS
from sigdb.recognition.training import Evaluation, Model

_TITLES = {
    "p_exact": "P(exact tooth)",
    "p_within_one": "P(within one)",
    "p_detected": "P(detected)",
    "none_on_healthy": "'none' on healthy",
    "circular_bias": "circular bias, teeth",
    "mae_stiffness_loss": "MAE stiffness_loss",
    "mae_phase_shift_deg": "MAE phase_shift_deg, deg",
    "mae_damaged_teeth": "MAE damaged_teeth",
    "coverage_stiffness_loss": "coverage of 90 % interval, stiffness_loss",
    "coverage_phase_shift_deg": "coverage of 90 % interval, phase_shift_deg",
    "coverage_damaged_teeth": "coverage of 90 % interval, damaged_teeth",
}
"""Names of figures as a reader sees them."""


def figure_rows(evaluation: Evaluation) -> list[list[str]]:
    """Head and rows of the table of figures: a row for each figure, a column for each estimator."""
    names = list(evaluation.figures)
    heads = [f"{name} (the model)" if name == evaluation.learner else name for name in names]
    return [["figure", *heads]] + [
        [title, *(str(evaluation.figures[name].get(key, "")) for name in names)]
        for key, title in _TITLES.items()
        if key in evaluation.figures[evaluation.learner]
    ]


def model_card(model: Model, evaluation: Evaluation, *, command: str) -> str:
    """The card as Markdown."""
    head, *rows = figure_rows(evaluation)
    table = "\n".join(
        ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head), *("| " + " | ".join(row) + " |" for row in rows)]
    )
    return f"""# {model.target.capitalize()} of tooth damage: {LEARNERS[model.learner]}

**Purpose.** {_PURPOSE[model.target]}

**Not for.** Other rigs, sensors or operating points than those of its training database; decisions about safety. Its
training data is simulated: on a measured signal its answer is a hypothesis to be checked.

**Training data.** {model.rows} simulated signatures of sensor `{model.sensor}` from {len(model.trained_on)} specimens
of the database `{model.database_hash[:12]}`, seed {model.seed}; table of folds `{model.split_hash[:12]}`.

**Input.** {_INPUT.get(model.learner, _POOLED_INPUT)}

## Figures

Split: {evaluation.split}. {evaluation.rows} rows of
{evaluation.specimens} specimens; in brackets the 95 % interval of a bootstrap over specimens, which is rough for few.
The test asks about the same damages as the training rows hold, on other gears: between and beyond them the figures are
worse. The best possible answer (the Bayes bound) is not computed.

{table}

`fm4` and `majority` are baselines: {_BASELINES[model.target]}

**Known failures.** {_FAILURES[model.target]}

## Make it again

    {command}
"""


_POOLED_INPUT = "Pooled Wigner-Ville features, speed and torque, seen from each tooth in turn."
_INPUT = {
    "templates": "The average itself, its number of revolutions, the scatter between them (the noise), speed and\n"
    "torque; templates of the nearest operating point, index errors of the size that the training rows have."
}
_PURPOSE = {
    "location": "Says at which tooth of the averaged gear the first damaged tooth is, or 'none'. Absolute tooth\n"
    "numbers need the tacho mark.",
    "severity": "Estimates stiffness loss, phase shift and number of damaged teeth of a damaged gear, each with an\n"
    "interval.",
}
_BASELINES = {
    "location": "a threshold on FM4 at a false-alarm rate of 0.01 (FM4 names no tooth, so the\n"
    "most frequent one is taken), and the most frequent answer of the training rows.",
    "severity": "a monotonic function of FM4, and the median of the training rows.",
}
_FAILURES = {
    "location": "The least severe cases are missed most often. Damage of another kind than was simulated is still\n"
    "given a tooth.",
    "severity": "On a healthy gear its answer has no meaning. Intervals hold on average, not for each severity.",
}
