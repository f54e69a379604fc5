"""A model beside the best possible answer to the same rows."""

from sigdb.core.errors import InputError
from sigdb.database import Database
from sigdb.recognition.bayes_bound import bound
from sigdb.recognition.evaluation import Evaluation, asked_rows, evaluate
from sigdb.recognition.training import Model


def evaluate_beside_bound(model: Model, database: Database) -> Evaluation:
    """Evaluate a model with the Bayes bound beside it, where the law of the rows allows to compute one.

    Parameters
    ----------
    model
        A trained model.
    database
        A finished database with the model's sensor first.

    Returns
    -------
    Evaluation
        As of :func:`evaluate`; its ``bound`` is None where no row follows the law that the bound knows, as in trains of
        several meshes.

    Raises
    ------
    InputError
        As :func:`evaluate`.
    """
    rows = asked_rows(model, database)
    try:
        best = bound(database, rows.index.to_numpy(), target=model.target, sensor=model.sensor)
    except InputError:
        return evaluate(model, database)
    values = {str(name): best.values[name] for name in best.values if not str(name).startswith("rmse")}
    return evaluate(model, database, bound=best.figures, bound_values=values)
