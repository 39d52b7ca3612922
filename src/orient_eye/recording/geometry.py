"""The shapes of a compiled model as Rerun archetypes, in the coordinates of their body [m]."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.rotations import rotation

Array = NDArray[np.float64]
_CREASE = np.deg2rad(40)  # edges sharper than this stay sharp
_VISIBLE_GROUPS = 3  # MuJoCo's viewers show geom groups 0 to 2


def geometry(model: mujoco.MjModel, body: int) -> dict[str, Any]:
    """Name to Rerun archetype of the visible geoms of a body, in the body's coordinates [m]."""
    drawn = {}
    for geom in (model.body_geomadr[body] + np.arange(model.body_geomnum[body])).tolist():
        if model.geom_group[geom] < _VISIBLE_GROUPS and _rgba(model, geom)[3] > 0:
            drawn[model.geom(geom).name or f"geom{geom}"] = _archetype(model, geom)
    return drawn


def _rgba(model: mujoco.MjModel, geom: int) -> NDArray[np.uint8]:
    # As MuJoCo's own viewer: the material's, unless the geom was given a colour of its own.
    rgba, material = model.geom_rgba[geom], model.geom_matid[geom]
    if material >= 0 and np.array_equal(rgba, np.array([0.5, 0.5, 0.5, 1], np.float32)):
        rgba = model.mat_rgba[material]
    return np.asarray(np.round(255 * rgba), np.uint8)


def _archetype(model: mujoco.MjModel, geom: int) -> Any:
    import rerun as rr

    shape = mujoco.mjtGeom(model.geom_type[geom])
    size, centre = model.geom_size[geom], model.geom_pos[geom]
    turned = model.geom_quat[geom]
    colour = _rgba(model, geom)
    placed: dict[str, Any] = {"quaternions": [np.roll(turned, -1)], "colors": [colour], "fill_mode": "solid"}
    match shape:
        case mujoco.mjtGeom.mjGEOM_MESH:
            vertices, triangles, normals = _mesh(model, int(model.geom_dataid[geom]))
            turn = rotation(turned)
            return rr.Mesh3D(
                vertex_positions=turn.apply(vertices) + centre,
                triangle_indices=triangles,
                vertex_normals=turn.apply(normals),
                albedo_factor=colour,
            )
        case mujoco.mjtGeom.mjGEOM_SPHERE | mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            half = np.where(size > 0, size, size[0])
            return rr.Ellipsoids3D(half_sizes=[half], centers=[centre], **placed)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return rr.Cylinders3D(lengths=[2 * size[1]], radii=[size[0]], centers=[centre], **placed)
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            start = centre - rotation(turned).apply([0, 0, size[1]])
            return rr.Capsules3D(lengths=[2 * size[1]], radii=[size[0]], translations=[start], **placed)
        case mujoco.mjtGeom.mjGEOM_PLANE:
            half = np.array([*np.where(size[:2] > 0, size[:2], model.stat.extent), 1e-4])
            return rr.Boxes3D(half_sizes=[half], centers=[centre], **placed)
        case _:  # a box, or the bounding box of what has no counterpart
            half = size if shape == mujoco.mjtGeom.mjGEOM_BOX else model.geom_aabb[geom, 3:]
            return rr.Boxes3D(half_sizes=[half], centers=[centre], **placed)


def _mesh(model: mujoco.MjModel, mesh: int) -> tuple[Array, NDArray[np.int64], Array]:
    """Vertices (n, 3), triangles (m, 3) and normals (n, 3) of a mesh; its sharp edges are split."""
    import trimesh

    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    vertices = model.mesh_vert[first : first + count]
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    solid = trimesh.Trimesh(vertices, model.mesh_face[first : first + count], process=False)
    # Without facets, which change next to nothing: what looks for them swallows every exception, Ctrl-C's too.
    shaded = trimesh.graph.smooth_shade(solid, angle=_CREASE, facet_minarea=None)
    return np.array(shaded.vertices), np.array(shaded.faces), np.array(shaded.vertex_normals)
