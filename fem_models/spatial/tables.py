"""Places of the numbers in the tables that the kernels share.

A kernel takes few arrays: each one is a handful of arguments of every call, and of what has to be compiled.
"""

from __future__ import annotations

# of a joint's constants, Parameters.joints (N, JOINT)
FRAME = 0  # cosine and sine of the notch's angle about the tube axis
SPRING = 2  # torsion, strong and weak bending, without the loop
REST = 5  # rotation vector without load
GIVE = 8  # compliance along the tube and in both shears
THRUST = 11  # force of the tendons at which the notch has its length
TURNING = 14  # length that lies along the mean direction of the rings
STEP = 15  # to the next joint, in the frame of the tube at rest
HALF = 18  # to the middle of the ring
CONTACT = 21  # angle of closure, stiffness, 1 where both sides close
LOOP = 24  # stiffness of the Jenkins elements: strong axis, then weak one
ELEMENTS = 3  # Jenkins elements of a bending axis, those of fem_models.joint.friction
SLIP = LOOP + 2 * ELEMENTS  # their slip moments
SHEARS = SLIP + 2 * ELEMENTS  # shear centre from the neutral axis, along 2, mm
JOINT = SHEARS + 1

# of a tendon over a joint, Parameters.crossings (N, m, CROSSING)
CARRIED = 0  # what the rings carry of the way from hole to hole
ARM = 3  # middle of both holes, from the centre of the joint
INWARD = 6  # direction in the ring before
ONWARD = 9  # direction in the ring beyond
LENGTH = 12  # way over the notch at rest
SEGMENT = 13  # EA over pitch
BRISTLE = 14  # stiffness of a sticking guide, on the ring before the joint
CROSSING = 15

# of a tendon, Parameters.tendons (m, TENDON)
FREE = 0  # EA over the length between wheel and base
TOE = 1
PRELOAD = 2
BY_FORCE = 3  # 1 where the drive is a tension
TENDON = 4

# of a joint's unknowns, x (N + 1, SLIPS + m): rotation vector, displacement (of the shear centre, where across), slips
# at the guide before it
MOVED = 3
SLIPS = 6

# of what a joint does, Work.bent (N, BENT)
MOMENT = 0  # gradient of the energy in the rotation vector
OFF = 3  # residual of the displacement
LOOSE = 6  # step of the displacement to its place,
SHIFT = 9  # and what that does to the moment
AHEAD = 12  # step of the rotation to its place, where no dead load holds it
BEND = 15  # slope of the moment in the rotation, row by row
BY_BEND = 24  # slope of the displacement in the rotation
BENT = 33

# of what a tendon does over a joint, Work.pulled (N, m, PULLED)
PULL = 0  # slope of the tension in the rotation, and of the moment in the stretch
BY_PULL = 3  # slope of the displacement in the stretch
FOLLOW = 6  # slope of the rotation in the stretch, where no dead load holds it
TIGHTENS = 9  # change of the tension as displacement (and rotation) go to their places
WRAP = 10  # turn of the tendon at the rings before and beyond
WRAP_AHEAD = 12  # their change as displacement (and rotation) go to their places
WRAP_BEND = 14  # slopes in the rotation, two vectors
WRAP_MOVED = 20  # slopes in the displacement, two vectors
UNIT = 26  # direction of the chord
LEVER = 29  # slope of its length in the rotation
STIFF = 32  # slope of the tension in the stretch
PULLED = 33

# of the slopes in the stretches of all tendons, Work.pairs (N, 3, m, m): of a tension, of its wraps
TENSION, WRAPS = 0, 1

# of matrices (3, 3) in Work.scratch (SCRATCH, 3)
KDD = 0  # of the force of the tendons by the displacement
KDP = 3  # by the rotation
KPP = 6  # of their moment by the rotation
SOLVE = 9
INVERSE = 12
ROWS = 15  # slope of a chord in half the rotation vector
SCRATCH = 18

# of a guide, Work.guides (N, m, GUIDE)
LIMIT = 0
UNBALANCED = 1  # tension before less tension beyond less friction, N
BY_TENSION = 2  # slopes of the friction
BY_SLIP = 3
BY_WRAP = 4
NET = 5  # tension before less tension beyond, and less the viscous force of a jump
FORCE = 6  # that the bristle would carry
HELD = 7  # stiffness of the bristle, 0 without friction
RATIO = 8  # slope of the limit in the sum of the tensions,
WRAPPED = 9  # and in the wrap
OPEN = 10  # stiffness that a guide has even where it slides
VISCOUS = 11  # slope of the viscous force in the slip
GUIDE = 12

# of a guide along a step in which guides change, Work.along (N, m, ALONG): net tension, force and limit
HERE = 0  # where the step starts
THERE = 3  # where it would end
ALONG = 6

# of a ring under dead loads, Work.rings (N, RING)
BEFORE = 0  # frame of the notch on the ring before it, row by row
SPIN = 9  # change of the rotation vector by the spins of the rings, row by row
TURNS = 18  # moment of the joint in space
WEIGHT_ARM = 21  # arm of the weights from here on, over one ring's weight
TIP_ARM = 24  # arm of the force at the tip
RING = 27

# of the rows of Motion.tendons (TENDON_ROWS, m)
FRONT, SPEED, DRIVE, WOUND, TENSE, HEADING, NEXT_HEADING, NEXT_DRIVE, SLOPE, GUESS = range(10)
TENDON_ROWS = 10
