"""Known changes hidden in measured records: exact, because only labels change."""

from validation.practice.hidden.draw import GROUPS, HiddenCase, draw_hidden_case, read_group

__all__ = ["GROUPS", "HiddenCase", "draw_hidden_case", "read_group"]
