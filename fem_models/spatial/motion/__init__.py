"""What a wrist in space does: its record, steps from an equilibrium, workspace, and drives for a wanted motion."""
