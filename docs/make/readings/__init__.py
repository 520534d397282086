"""The page on the two readings of the paper's widths, made from figures that are stored beside it."""
