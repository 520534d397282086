"""The manipulator: rig, analytic single notched ring, kinematics, Exudyn multibody model, pictures."""
