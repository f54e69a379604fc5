"""What joins the layers for a person: whole recipes, models from databases, pictures, rigs described and begun."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.pipeline.card import database_card
    from sigdb.pipeline.describe import describe_rig, draw_rig
    from sigdb.pipeline.diagnosis import Diagnosis, write_diagnosis
    from sigdb.pipeline.models import train_model
    from sigdb.pipeline.new_rig import write_new_rig
    from sigdb.pipeline.paper.results import paper_claims
    from sigdb.pipeline.pictures import draw_coverage, draw_signature
    from sigdb.pipeline.recipe import Recipe, load_recipe
    from sigdb.pipeline.recipe_models import Result
    from sigdb.pipeline.recorded import recorded_signature
    from sigdb.pipeline.recorded_diagnosis import diagnose
    from sigdb.pipeline.recorded_histories import recorded_history
    from sigdb.pipeline.recorded_result import RecordedSignature
    from sigdb.pipeline.run import Made, run_recipe
    from sigdb.pipeline.synthetic.recording import synthetic_recording
    from sigdb.pipeline.synthetic.surroundings import Surroundings

__all__ = [
    "Diagnosis",
    "Made",
    "Recipe",
    "RecordedSignature",
    "Result",
    "Surroundings",
    "database_card",
    "describe_rig",
    "diagnose",
    "draw_coverage",
    "draw_rig",
    "draw_signature",
    "load_recipe",
    "paper_claims",
    "recorded_history",
    "recorded_signature",
    "run_recipe",
    "synthetic_recording",
    "train_model",
    "write_diagnosis",
    "write_new_rig",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "diagnose": "sigdb.pipeline.recorded_diagnosis",
        "write_diagnosis": "sigdb.pipeline.diagnosis",
        "Diagnosis": "sigdb.pipeline.diagnosis",
        "Made": "sigdb.pipeline.run",
        "Recipe": "sigdb.pipeline.recipe",
        "Result": "sigdb.pipeline.recipe_models",
        "RecordedSignature": "sigdb.pipeline.recorded_result",
        "Surroundings": "sigdb.pipeline.synthetic.surroundings",
        "database_card": "sigdb.pipeline.card",
        "describe_rig": "sigdb.pipeline.describe",
        "draw_coverage": "sigdb.pipeline.pictures",
        "draw_rig": "sigdb.pipeline.describe",
        "draw_signature": "sigdb.pipeline.pictures",
        "load_recipe": "sigdb.pipeline.recipe",
        "paper_claims": "sigdb.pipeline.paper.results",
        "recorded_history": "sigdb.pipeline.recorded_histories",
        "recorded_signature": "sigdb.pipeline.recorded",
        "run_recipe": "sigdb.pipeline.run",
        "synthetic_recording": "sigdb.pipeline.synthetic.recording",
        "train_model": "sigdb.pipeline.models",
        "write_new_rig": "sigdb.pipeline.new_rig",
    },
)
