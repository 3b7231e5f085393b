"""All limits of the viewer: what a page may request from the simulation, and what a browser may send."""

# Lengths and coordinates in a command [m].
SMALLEST_LENGTH, LARGEST_LENGTH = 1e-4, 1e3
FARTHEST = 1e4

# Of one live scene.
MOST_BODIES = 64
MOST_TETS = 400_000
MOST_GRABS = 16
MOST_PINS = 256  # vertices pinned on the page

# Of one new body.
SHAPES = ("box", "sphere", "cylinder", "torus", "gummy_bear")
COARSEST, FINEST = 3, 24  # edges across the shape

# Of time.
SLOWEST_MOTION, FASTEST_MOTION = 0.01, 1.0
MOST_STEPS = 1_000  # of one Step command
# A step that takes longer is given up; where a pause or reset is requested meanwhile, after the second time [s].
LONGEST_STEP, LONGEST_STEP_WHEN_ASKED = 20.0, 1.0
FRAMES_PER_SECOND = 60.0  # snapshots that the simulation sends

# Squash and stretch, as a factor of the present height.
FLATTEST, TALLEST = 0.2, 3.0

# Stiffness of the spring of a grab, as a factor of its default.
WEAKEST_GRAB, STRONGEST_GRAB = 0.01, 100.0
# Largest distance over which a grab pulls, as a factor of the size of the scene.
LONGEST_GRAB = 3.0

# Commands that wait for the simulation; further commands are dropped.
MOST_WAITING = 512
# Messages of one browser: rate, and number at once (token bucket). A pointer moves 60 to 240 times a second.
MESSAGES_PER_SECOND, MESSAGES_AT_ONCE = 600.0, 1_200.0
# One message of a browser [bytes], and one message with a picture that the server requested.
LARGEST_MESSAGE, LARGEST_PICTURE = 64 * 1024, 32 * 1024 * 1024
# Rate of large messages of one browser [bytes/s].
LARGE_MESSAGES_PER_SECOND = 64 * 1024 * 1024

# Upload of a surface: size of the file and of its parts, as viser sends them [bytes]; number of triangles; time [s] and
# memory [bytes] for reading and meshing it; number of files at the same time; a transfer that makes no progress for
# UPLOAD_TIMEOUT [s] is given up.
UPLOAD_FORMATS = (".stl", ".obj", ".ply", ".off", ".vtp", ".vtk")
LARGEST_UPLOAD, UPLOAD_PART = 16 * 1024 * 1024, 512 * 1024
MOST_UPLOADED_TRIANGLES = 20_000
LONGEST_UPLOAD, UPLOAD_MEMORY = 60.0, 3 * 2**30
MOST_UPLOADS, UPLOAD_TIMEOUT = 4, 60.0

# Connections of any kind, also without a token; and browsers with an open page.
MOST_CONNECTIONS = 256
MOST_CLIENTS = 32
# In which time a browser sends its first message [s]; a page sends its camera as soon as it is drawn.
FIRST_MESSAGE = 60.0

# Contact points, and forces of contacts, in a snapshot.
MOST_CONTACT_POINTS, MOST_CONTACT_FORCES = 2_000, 400
