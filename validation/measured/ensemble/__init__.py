"""The ensemble of the preset du2018: all calibrations that meet the paper's facts, and what they predict."""
