"""A scene of `checked_scenes` in MuJoCo flex. Prints one JSON line. Runs in a separate environment.

usage: checked_mujoco.py SCENE OUT.npz
"""

import json
import sys

import mujoco
import numpy as np
from checked_scenes import DENSITY, FPS, FRAMES, POISSON, YOUNGS, save, scene

name, out = sys.argv[1:3]
STEPS = 20
own = scene(name)
parts = []
for k, (points, _, tets) in enumerate(own.bodies()):
    edges = points[tets[:, 1:]] - points[tets[:, :1]]
    mass = DENSITY * float(np.abs(np.linalg.det(edges)).sum()) / 6
    parts.append(
        f'<flexcomp name="body{k}" type="direct" dim="3" mass="{mass}" radius=".001" '
        f'point="{" ".join(map(repr, points.ravel().tolist()))}" element="{" ".join(map(str, tets.ravel().tolist()))}">'
        f'<elasticity young="{YOUNGS}" poisson="{POISSON}" damping="0"/><edge equality="false"/></flexcomp>'
    )
floor = '<geom type="plane" size="5 5 .1"/>' if own.floor else ""
xml = f"""<mujoco><option timestep="{1 / FPS / STEPS}" solver="CG" gravity="0 0 {own.gravity}"/>
<size memory="500M"/><worldbody>{floor}{"".join(parts)}</worldbody></mujoco>"""
model = mujoco.MjModel.from_xml_string(xml)
data = mujoco.MjData(model)
bodies = np.array(model.flex_vertbodyid)
for axis in range(3):
    data.qvel[model.body_dofadr[bodies] + axis] = own.velocities[:, axis]
mujoco.mj_forward(model, data)
assert np.allclose(data.flexvert_xpos, own.points, atol=1e-9)
frames = [np.array(data.flexvert_xpos)]
for _ in range(FRAMES):
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
    frames.append(np.array(data.flexvert_xpos))
save(out, frames, own, np.array(model.body_mass)[bodies])
print(json.dumps({"version": mujoco.__version__}))
