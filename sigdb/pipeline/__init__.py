"""What joins the layers for a person: recipes, models from databases, pictures of rows."""

from sigdb.pipeline.models import train_model
from sigdb.pipeline.pictures import draw_signature
from sigdb.pipeline.recipe import Recipe, load_recipe

__all__ = ["Recipe", "draw_signature", "load_recipe", "train_model"]
