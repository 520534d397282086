"""Practice cases: simulated records with injected effects, and how often the tracer is right on them."""

from validation.practice.draw import Case, Truth, draw_case

__all__ = ["Case", "Truth", "draw_case"]
