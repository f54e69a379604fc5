"""Views of a recording before a diagnosis: intervals of its indicators, its envelope and its order map."""
