"""What joins the layers for a person: recipes, models from databases, pictures of rows, rigs described and begun."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.pipeline.describe import describe_rig, draw_rig
    from sigdb.pipeline.models import train_model
    from sigdb.pipeline.new_rig import write_new_rig
    from sigdb.pipeline.pictures import draw_signature
    from sigdb.pipeline.recipe import Recipe, load_recipe

__all__ = [
    "Recipe",
    "describe_rig",
    "draw_rig",
    "draw_signature",
    "load_recipe",
    "train_model",
    "write_new_rig",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Recipe": "sigdb.pipeline.recipe",
        "describe_rig": "sigdb.pipeline.describe",
        "draw_rig": "sigdb.pipeline.describe",
        "draw_signature": "sigdb.pipeline.pictures",
        "load_recipe": "sigdb.pipeline.recipe",
        "train_model": "sigdb.pipeline.models",
        "write_new_rig": "sigdb.pipeline.new_rig",
    },
)
