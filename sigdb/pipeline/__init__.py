"""What joins the layers for a person: whole recipes, models from databases, pictures, rigs described and begun."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.pipeline.card import database_card
    from sigdb.pipeline.describe import describe_rig, draw_rig
    from sigdb.pipeline.models import train_model
    from sigdb.pipeline.new_rig import write_new_rig
    from sigdb.pipeline.paper.results import paper_claims
    from sigdb.pipeline.pictures import draw_coverage, draw_signature
    from sigdb.pipeline.recipe import Recipe, load_recipe
    from sigdb.pipeline.recipe_models import Result
    from sigdb.pipeline.run import Made, run_recipe

__all__ = [
    "Made",
    "Recipe",
    "Result",
    "database_card",
    "describe_rig",
    "draw_coverage",
    "draw_rig",
    "draw_signature",
    "load_recipe",
    "paper_claims",
    "run_recipe",
    "train_model",
    "write_new_rig",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Made": "sigdb.pipeline.run",
        "Recipe": "sigdb.pipeline.recipe",
        "Result": "sigdb.pipeline.recipe_models",
        "database_card": "sigdb.pipeline.card",
        "describe_rig": "sigdb.pipeline.describe",
        "draw_coverage": "sigdb.pipeline.pictures",
        "draw_rig": "sigdb.pipeline.describe",
        "draw_signature": "sigdb.pipeline.pictures",
        "load_recipe": "sigdb.pipeline.recipe",
        "paper_claims": "sigdb.pipeline.paper.results",
        "run_recipe": "sigdb.pipeline.run",
        "train_model": "sigdb.pipeline.models",
        "write_new_rig": "sigdb.pipeline.new_rig",
    },
)
