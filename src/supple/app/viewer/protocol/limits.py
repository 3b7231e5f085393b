"""The limits of what a page may request from the simulation."""

# Coordinates in a command [m].
FARTHEST = 1e4

# Of one live scene.
MOST_GRABS = 16
MOST_PINS = 256  # vertices pinned on the page

# Of time.
SLOWEST_MOTION, FASTEST_MOTION = 0.01, 1.0
MOST_STEPS = 1_000  # of one Step command
# A step that takes longer is given up; where a pause or reset is requested meanwhile, after the second time [s].
LONGEST_STEP, LONGEST_STEP_WHEN_ASKED = 20.0, 1.0
FRAMES_PER_SECOND = 60.0  # snapshots that the simulation sends

# Stiffness of the spring of a grab, as a factor of its default.
WEAKEST_GRAB, STRONGEST_GRAB = 0.01, 100.0
# Largest distance over which a grab pulls, as a factor of the size of the scene.
LONGEST_GRAB = 3.0

# Commands that wait for the simulation; further commands are dropped.
MOST_WAITING = 512

# Contact points, and forces of contacts, in a snapshot.
MOST_CONTACT_POINTS, MOST_CONTACT_FORCES = 2_000, 400
