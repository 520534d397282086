"""Clean rigs of other makes than the tracer's models, and what is learnt of them; none of them is ever scored."""

from validation.practice.clean_makes.maxwell_slip import draw_maxwell_slip
from validation.practice.clean_makes.uneven_notches import draw_uneven_notches

__all__ = ["draw_maxwell_slip", "draw_uneven_notches"]
