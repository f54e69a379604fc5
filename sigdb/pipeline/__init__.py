"""What joins the layers for a person: recipes, models from databases, pictures of rows."""

from typing import TYPE_CHECKING

from sigdb.core.lazy import lazy_names

if TYPE_CHECKING:
    from sigdb.pipeline.models import train_model
    from sigdb.pipeline.pictures import draw_signature
    from sigdb.pipeline.recipe import Recipe, load_recipe

__all__ = [
    "Recipe",
    "draw_signature",
    "load_recipe",
    "train_model",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Recipe": "sigdb.pipeline.recipe",
        "draw_signature": "sigdb.pipeline.pictures",
        "load_recipe": "sigdb.pipeline.recipe",
        "train_model": "sigdb.pipeline.models",
    },
)
