"""Model against model, and model against measurement."""
