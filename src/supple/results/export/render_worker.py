"""The child process that traces the light of a .gif, .mp4 or .png: `render_worker RECORDING OUTPUT FILM`."""

from __future__ import annotations

import sys
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from supple.results.export.video import Film
from supple.results.export.video_worker import ANGLE, LIGHTS, Pictures, axes_of, connections, main
from supple.results.view.fields import colors_of
from supple.results.view.floor_shadow import floor_shadow
from supple.results.view.look import LOOKS, Look, floor_disc, theme
from supple.results.view.model import Model, RenderFrame
from supple.results.view.normals import vertex_normals
from supple.results.view.surfaces import RigidSurface, SoftSurface, has_fields

_SAMPLES = 64
_PASSES = 8  # of a picture: what only one of them has is a firefly
_DEPTH = 16  # surfaces on a path: through three bears, one behind the other, and back from the floor
_FLOOR_CELLS = 512
# Of the panorama of light, which contains the lights as discs: its rows, and the half angles of discs [degrees].
_ROWS, _DISCS = 128, (16.0, 24.0, 20.0)
_LOWEST = 32.0  # elevation of lights [degrees]: lower ones would be seen behind the bodies
_HORIZON = 12.0  # elevation of the end of the background [degrees]
_SKY = 0.18  # radiance above, of the light that a white floor reflects
_FEATURE_SAMPLES = 2
_STEPS, _SPLINE = (1, 2, 4), (1 / 16, 4 / 16, 6 / 16, 4 / 16, 1 / 16)  # of the filter against grain [pixels]
# Differences that part what is shown: of the numbers of surfaces, of normals, and of depths in radii.
_WIDTHS = np.array([0.3, 0.25, 0.25, 0.25, 0.25])
_TOLERANCE = 16.0  # variances by which light may differ; with 4, a floor of 24 samples keeps spots
_APERTURE = 0.005  # radius of the lens, as a share of the distance of the camera


class Tracer(Pictures):
    """A scene of Mitsuba for each picture, with what all pictures have in common."""

    def __init__(self, model: Model, render_frames: list[RenderFrame], film: Film) -> None:
        mitsuba: Any = import_module("mitsuba")
        mitsuba.set_variant("scalar_rgb")  # needs no LLVM
        super().__init__(model, render_frames, film)
        self._mitsuba = mitsuba
        # Walls about the scene, of which a film has a trace, are not drawn.
        drawn = (surface for _, surface in self._surfaces(model))
        self._meshes = [(_material(one), one) for one in drawn if one.container or one.opacity == 1.0]
        self._lines = [
            (SimpleNamespace(points=None, color=color), segments)
            for segments, color in (connections(model) if film.connections else [])
        ]
        self._around = {"light": self._light(), "background": self._background()} | self._floor(model)
        self._camera: dict[str, Any] = {}
        count = _SAMPLES if film.samples is None else film.samples
        self._passes = [len(part) for part in np.array_split(range(count), min(_PASSES, count))]
        self._progress, self._task = _bar(len(render_frames) * len(self._passes))
        self._pictures = 0

    def _light(self) -> dict[str, Any]:
        """A panorama above `_HORIZON`: the sky, which begins with the color of the background, and lights."""
        shown, axes = theme(self._film.dark), axes_of(self._view)
        theta = np.pi * (np.arange(_ROWS) + 0.5) / _ROWS
        phi = np.pi * (np.arange(2 * _ROWS) + 0.5) / _ROWS
        height = np.cos(theta)[:, None]
        d = np.stack(
            np.broadcast_arrays(np.sin(phi) * np.sin(theta)[:, None], height, -np.cos(phi) * np.sin(theta)[:, None]), -1
        )
        above = np.clip((np.arcsin(height) - np.radians(_HORIZON)) / 0.3, 0.0, 1.0)[..., None]
        image = (1.0 - above) * _linear(shown.bottom) + above * _SKY * _linear((246, 248, 252))
        image = image * np.broadcast_to(height > np.sin(np.radians(_HORIZON)), d.shape[:2])[..., None]
        weight = np.maximum(height, 0.0) * np.sin(theta)[:, None] / _ROWS**2 * np.pi  # of what a floor receives
        missing = 1.0 - float((weight[..., None] * image).sum(axis=(0, 1)).mean())
        discs = np.zeros_like(image)
        for (direction, color, strength), angle in zip(LIGHTS, _DISCS, strict=True):
            toward = np.array(direction)
            toward[1] = max(toward[1], np.tan(np.radians(_LOWEST)) * np.hypot(toward[0], toward[2]))
            cosine = d @ (toward / np.linalg.norm(toward))
            disc = np.clip((np.arccos(np.clip(cosine, -1.0, 1.0)) - np.radians(angle)) / -0.06 + 0.5, 0.0, 1.0)
            disc = disc[..., None] * strength / np.radians(angle) ** 2
            discs = discs + disc * _linear(tuple(int(color[k : k + 2], 16) for k in (1, 3, 5)))
        image = image + discs * missing / float((weight[..., None] * discs).sum(axis=(0, 1)).mean())
        turned = np.eye(4)
        turned[:3, :3] = axes.T
        bitmap = self._mitsuba.Bitmap(image.astype(np.float32))
        return {"type": "envmap", "bitmap": bitmap, "to_world": self._mitsuba.ScalarTransform4f(turned)}

    def _background(self) -> dict[str, Any]:
        """Far around and below, in the color behind bodies: it is seen, and not searched for light."""
        columns, rows = 96, 24
        theta = np.radians(np.linspace(90.0 - _HORIZON, 180.0, rows))
        phi = 2.0 * np.pi * np.arange(columns) / columns
        ring = np.stack([np.cos(phi), np.zeros(columns), np.sin(phi)], axis=1)
        d = np.sin(theta)[:, None, None] * ring + np.cos(theta)[:, None, None] * [0.0, 1.0, 0.0]
        x = self._view.center + 1e3 * self._view.radius * d.reshape(-1, 3) @ axes_of(self._view)
        i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
        a, b, c, e = (((i + p) * columns + (j + q) % columns).ravel() for p, q in ((0, 0), (0, 1), (1, 1), (1, 0)))
        mi, given = self._mitsuba, self._mitsuba.Properties()
        given["emitter"] = mi.load_dict(
            {"type": "area", "radiance": _rgb(_linear(theme(self._film.dark).bottom)), "sampling_weight": 0.0}
        )
        return self._filled(given, "background", x, np.concatenate([np.stack([a, c, b], 1), np.stack([a, e, c], 1)]))

    def _filled(self, given: Any, name: str, x: NDArray[np.float64], triangles: NDArray[Any]) -> Any:
        """A mesh of Mitsuba."""
        mesh = self._mitsuba.Mesh(name, len(x), len(triangles), props=given, has_vertex_normals=True)
        arrays = self._mitsuba.traverse(mesh)
        arrays["vertex_positions"] = x.astype(np.float32).ravel()
        arrays["vertex_normals"] = vertex_normals(x, triangles.astype(np.int32)).astype(np.float32).ravel()
        arrays["faces"] = triangles.astype(np.uint32).ravel()
        arrays.update()
        return mesh

    def _floor(self, model: Model) -> dict[str, Any]:
        """The disc that bodies stand on, or the table under a bowl, which fades to the background outwards."""
        floor = floor_shadow(model, 1)
        if floor is None:
            return {}
        colors = floor_disc(self._film.dark, _FLOOR_CELLS)
        mask = self._mitsuba.Bitmap((colors[..., 3:] / 255.0).astype(np.float32))
        opacity = {"type": "bitmap", "bitmap": mask, "raw": True, "wrap_mode": "clamp"}
        cloth = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": _rgb(_linear(tuple(colors[0, 0, :3])))}}
        plane = np.eye(4)
        plane[:3, 0], plane[:3, 1] = 0.5 * (floor.disc[1] - floor.disc[0]), 0.5 * (floor.disc[3] - floor.disc[0])
        plane[:3, 2], plane[:3, 3] = model.view.up, floor.disc.mean(axis=0)
        place = self._mitsuba.ScalarTransform4f(plane)
        bsdf = {"type": "mask", "opacity": opacity, "nested": cloth}
        return {"floor": {"type": "rectangle", "to_world": place, "bsdf": bsdf}}

    def _look(self, eye: NDArray[np.float64], target: NDArray[np.float64], up: NDArray[np.float64]) -> None:
        width, height = self._film.size
        film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}, "pixel_format": "rgb"}
        self._eye, self._ahead = eye, (target - eye) / np.linalg.norm(target - eye)
        self._camera = {
            "type": "thinlens",
            "aperture_radius": _APERTURE * self._distance,
            "fov": ANGLE,
            "fov_axis": "y",
            "near_clip": 1e-3 * self._view.radius,
            "far_clip": 1e3 * (self._view.radius + self._distance),
            "to_world": self._mitsuba.ScalarTransform4f().look_at(
                origin=eye.tolist(), target=target.tolist(), up=up.tolist()
            ),
            "film": film | {"component_format": "float32"},
            "sampler": {"type": "multijitter", "sample_count": 1},
        }

    def _drawn(self, points: list[NDArray[np.float64]], nodal: NDArray[np.float64] | None) -> NDArray[np.uint8]:
        scene: dict[str, Any] = {"type": "scene", "integrator": {"type": "path", "max_depth": _DEPTH}} | self._around
        for k, ((material, surface), x) in enumerate(zip(self._meshes, points, strict=True)):
            scene[f"surface{k}"] = self._mesh(material, surface, x, nodal)
        # As wide as in films: a 240th of the height of the picture, at least a pixel.
        thick = self._distance * float(np.tan(np.radians(0.5 * ANGLE))) / min(240, self._film.size[1])
        for k, (line, _) in enumerate(self._lines):
            matt = {"type": "diffuse", "reflectance": _rgb(_linear(line.color))}
            for j, (a, b) in enumerate(line.points.reshape(-1, 2, 3)):
                if not np.array_equal(a, b):
                    ends = {"p0": a.tolist(), "p1": b.tolist(), "radius": thick}
                    scene[f"line{k}_{j}"] = {"type": "cylinder", "bsdf": {"type": "twosided", "bsdf": matt}} | ends
        # The nearer half of the bodies is sharp.
        depths = np.concatenate([x @ self._ahead for x in points[: self._bodies]]) - self._eye @ self._ahead
        focus = max(float(np.quantile(depths, 0.3)), 1e-2 * self._view.radius)
        scene["camera"] = self._camera | {"focus_distance": focus}
        loaded = self._mitsuba.load_dict(scene)
        passes = []
        # The same seeds for each picture: grain that stands still neither flickers nor fills a film's file.
        for seed, count in enumerate(self._passes):
            passes.append(np.array(self._mitsuba.render(loaded, spp=count, seed=seed), dtype=np.float32))
            self._progress.update(self._task, advance=1)
        return _developed(_without_grain(np.stack(passes), self._features(loaded)))

    def _features(self, scene: Any) -> NDArray[Any]:
        """(height, width, 5) what each pixel shows, without light: surface, normal, and depth in radii of the scene."""
        aovs = self._mitsuba.load_dict({"type": "aov", "aovs": "surface:shape_index,normal:sh_normal,depth:depth"})
        found = np.array(self._mitsuba.render(scene, integrator=aovs, spp=_FEATURE_SAMPLES), dtype=np.float32)[..., -5:]
        found[..., 4] = np.minimum(found[..., 4] / self._view.radius, 20.0)
        return found

    def _mesh(
        self,
        material: dict[str, Any],
        surface: SoftSurface | RigidSurface,
        x: NDArray[np.float64],
        nodal: NDArray[np.float64] | None,
    ) -> Any:
        mi, triangles = self._mitsuba, surface.triangles
        if surface.container:  # as in films, the side towards the camera is cut away
            a, b, c = (x[triangles[:, k]] for k in range(3))
            facing = np.einsum("ij,ij->i", np.cross(b - a, c - a), self._eye - a) > 0.0
            triangles = triangles[~facing]
        colors: NDArray[np.float64] | None = None
        if self._field and self._limits and nodal is not None and has_fields(surface):
            values = surface.of(np.repeat(nodal[:, None], 3, axis=1))[:, 0]
            colors = _linear(colors_of(self._field, values, self._limits))
            reflectance = {"type": "mesh_attribute", "name": "vertex_color"}
            material = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}
        given = mi.Properties()
        given["bsdf"] = mi.load_dict(material)
        mesh = self._filled(given, surface.name, x, triangles)
        if colors is not None:
            mesh.add_attribute("vertex_color", 3, colors.astype(np.float32).ravel())
        return mesh


def _material(surface: SoftSurface | RigidSurface) -> dict[str, Any]:
    """Of Mitsuba, for a look."""
    look, color = surface.look, _linear(surface.color)
    if look is LOOKS["gummy"]:
        gel = {"spec_trans": 0.7, "roughness": 0.1, "eta": 1.35}
        return {"type": "principled", "base_color": _rgb(0.98 * color / max(color.max(), 1e-3))} | gel
    if look is LOOKS["steel"]:
        metal = {"type": "roughconductor", "material": "none", "specular_reflectance": _rgb(color), "alpha": 0.15}
        return {"type": "twosided", "bsdf": metal}
    return {"type": "twosided", "bsdf": _matt(look, color)}


def _matt(look: Look, color: NDArray[np.float64]) -> dict[str, Any]:
    if look is LOOKS["rubber"]:
        return {"type": "roughplastic", "diffuse_reflectance": _rgb(color), "alpha": 0.25, "nonlinear": True}
    return {"type": "diffuse", "reflectance": _rgb(color)}


def _rgb(color: NDArray[np.float64]) -> dict[str, Any]:
    return {"type": "rgb", "value": color.tolist()}


def _linear(color: Any) -> NDArray[np.float64]:
    """Light of a color of sRGB from 0 to 255 (IEC 61966-2-1)."""
    share = np.asarray(color, dtype=np.float64) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def _without_grain(passes: NDArray[Any], features: NDArray[Any]) -> NDArray[Any]:
    """Light (height, width, 3) of passes (p, height, width, 3) and features (height, width, 5) of its pixels.

    A rare path of much light is a bright point in one pass: a pass counts with at most four times the mean of the
    others. Then each pixel is a mean over neighbours that show the same and differ by no more than their passes do: an
    edge-avoiding wavelet (Dammertz et al., Edge-avoiding A-Trous wavelet transform, 2010).
    """
    bright = passes.max(axis=-1)
    light = passes.mean(axis=0)
    if len(passes) == 1:
        return light
    others = (bright.sum(axis=0) - bright.max(axis=0)) / (len(passes) - 1)
    passes = passes * np.minimum(1.0, (4.0 * others + 0.02) / np.maximum(bright, 1e-12))[..., None]
    light = passes.mean(axis=0)
    noise = uniform_filter(passes.var(axis=0, ddof=1).mean(axis=-1) / len(passes), 5)[..., None] + 1e-8
    shown = (features / _WIDTHS).astype(np.float32)
    for step in _STEPS:
        light, noise = _smoothed(light, noise, shown, step)
    return light


def _smoothed(
    light: NDArray[Any], noise: NDArray[Any], shown: NDArray[Any], step: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Light (height, width, 3) and its variance (height, width, 1), with neighbours at multiples of a step."""
    rows, columns, margin = *light.shape[:2], 2 * step
    padded = [np.pad(one, ((margin, margin), (margin, margin), (0, 0)), mode="edge") for one in (light, noise, shown)]
    mean, variance, total = np.zeros_like(light), np.zeros_like(noise), np.zeros_like(noise)
    for i, row_weight in enumerate(_SPLINE):
        for j, column_weight in enumerate(_SPLINE):
            y, x = i * step, j * step
            near, varies, same = (one[y : y + rows, x : x + columns] for one in padded)
            apart = ((near - light) ** 2).mean(axis=-1, keepdims=True) / (_TOLERANCE * (varies + noise))
            apart += ((same - shown) ** 2).sum(axis=-1, keepdims=True)
            weight = row_weight * column_weight * np.exp(-apart)
            mean, variance, total = mean + weight * near, variance + weight**2 * varies, total + weight
    return mean / total, variance / total**2


def _developed(light: NDArray[Any]) -> NDArray[np.uint8]:
    """(height, width, 3) of sRGB; highlights end softly."""
    light = np.where(light > 0.8, 1.0 - 0.2 * np.exp(-(light - 0.8) / 0.2), light)
    shown = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-12) ** (1 / 2.4) - 0.055)
    return np.round(255.0 * np.clip(shown, 0.0, 1.0)).astype(np.uint8)


def _bar(passes: int) -> tuple[Any, Any]:
    """A bar with the time left, on a terminal; it disappears at its end."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    console = Console()
    columns = TextColumn("tracing light"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()
    progress = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    progress.start()
    return progress, progress.add_task("", total=passes)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], Tracer))
