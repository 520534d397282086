"""Drawings of a rig for a workshop, and rigs from drawings, tables and curves."""

from studies.drawings.written import DRAWINGS, DrawingChoice, drawing_files, write_drawing

__all__ = ["DRAWINGS", "DrawingChoice", "drawing_files", "write_drawing"]
