"""What one page may ask of the simulation behind it. Every limit of the viewer stands here, and nowhere else."""

from __future__ import annotations

# Lengths and places that a command may name [m].
SMALLEST_LENGTH, LARGEST_LENGTH = 1e-4, 1e3
FARTHEST = 1e4
FASTEST = 1e3  # velocities [m/s]

# Of one scene while it runs.
MOST_BODIES = 64
MOST_TETS = 400_000
MOST_GRABS = 16
MOST_PINS = 256  # vertices pinned by hand

# Of one new body.
SHAPES = ("box", "sphere", "cylinder", "torus", "gummy_bear")
COARSEST, FINEST = 3, 24  # edges across the shape

# Of time.
SLOWEST_MOTION, FASTEST_MOTION = 0.01, 1.0
MOST_STEPS = 1_000  # of one Step command
# A step that takes longer is given up; where somebody asks to pause or reset meanwhile, after the second time [s].
LONGEST_STEP, LONGEST_STEP_WHEN_ASKED = 20.0, 1.0
FRAMES_PER_SECOND = 60.0  # snapshots that leave the simulation

# Squash and stretch, as a factor of the present height.
FLATTEST, TALLEST = 0.2, 3.0

# A grab's spring, as a factor of the strength that suits its body.
WEAKEST_GRAB, STRONGEST_GRAB = 0.01, 100.0
# How far a grab's target may pull away from the body, as a factor of the scene's size.
LONGEST_GRAB = 3.0

# Commands on their way to the simulation: those beyond are dropped.
MOST_WAITING = 512
# Messages of one browser: refilled at this rate, and this many at once. A pointer moves 60 to 240 times a second.
MESSAGES_PER_SECOND, MESSAGES_AT_ONCE = 600.0, 1_200.0
# One message of a browser [bytes], and one that holds a picture which it was asked for.
LARGEST_MESSAGE, LARGEST_PICTURE = 64 * 1024, 32 * 1024 * 1024
# Of any one browser, in large messages [bytes/s].
LARGE_MESSAGES_PER_SECOND = 64 * 1024 * 1024

# Of a surface that a visitor uploads: its file [bytes], in parts as viser sends them, and its triangles. Reading it and
# filling it with tets may take this long [s] and this much memory [bytes]. Files that come in at once; one that gets no
# further for this long [s] is given up.
UPLOAD_FORMATS = (".stl", ".obj", ".ply", ".off", ".vtp", ".vtk")
LARGEST_UPLOAD, UPLOAD_PART = 16 * 1024 * 1024, 512 * 1024
MOST_UPLOADED_TRIANGLES = 20_000
LONGEST_UPLOAD, UPLOAD_MEMORY = 60.0, 3 * 2**30
MOST_UPLOADS, UPLOAD_TIMEOUT = 4, 60.0

# Connections of any kind, also of those that have not shown a token; and browsers with an open page.
MOST_CONNECTIONS = 256
MOST_CLIENTS = 32

# Points of contact that a snapshot tells of.
MOST_CONTACT_POINTS = 2_000
