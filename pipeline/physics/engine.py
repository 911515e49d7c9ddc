"""A SAPIEN world with a table and catalogue objects on it, with or without a renderer.

The world frame WCS: z up, the table's top at z = 0, its centre at the origin. Physics is PhysX on
the CPU with one thread and its enhanced determinism: equal calls give equal bits.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import sapien
from jaxtyping import Float

from pipeline.config.scenes import ScenesConfig
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import pose_from, position_quaternion
from pipeline.physics import appearance
from pipeline.physics.vulkan import new_render_system

TABLE_BODY_ID = 0  # segmentation holds 0 where no object is
"""Segmentation id of the table and of everything else that is not an object."""

_TABLE_THICKNESS_M = 0.2  # thick enough that no body passes through in one step
_GRAVITY_M_S2 = (0.0, 0.0, -9.81)  # standard gravity to three digits
# PhysX pulls shapes together to the rest offset, so 0 leaves no visible slit; contacts are made
# from the contact offset on, far under the 10 mm default that suits room-sized scenes.
_REST_OFFSET_M = 0.0
_CONTACT_OFFSET_M = 0.002
_POSITION_ITERATIONS = 16
_VELOCITY_ITERATIONS = 2
# Interpenetration is undone gently: the default bound lets pushed-apart bodies jump.
_DEPENETRATION_M_S = 0.5
# Stands in for rolling resistance, which PhysX lacks: without it a ball rolls off any table.
_ROLLING_DAMPING_1_S = 3.0


@dataclass(frozen=True, eq=False)
class Body:
    """One rigid object in a world."""

    body_id: int
    """1-based segmentation id; 0 is the table."""
    entity: sapien.Entity
    rigid: sapien.physx.PhysxRigidDynamicComponent

    @property
    def world_from_object(self) -> Float[np.ndarray, "4 4"]:
        """Pose of the object's frame (origin = centre of mass) in WCS."""
        return pose_matrix(self.entity.pose)

    @property
    def linear_speed_m_s(self) -> float:
        """Speed of the centre of mass [m/s]."""
        return float(np.linalg.norm(self.rigid.linear_velocity))

    @property
    def angular_speed_rad_s(self) -> float:
        """Rate of rotation [rad/s]."""
        return float(np.linalg.norm(self.rigid.angular_velocity))


def roll_freely(body: Body, free: bool) -> None:
    """Switch a body's damping off while it is carried, or on again.

    The damping stands in for rolling resistance. In the air it would be a drag, felt as a load that
    no real object has.

    Parameters
    ----------
    body
        The body.
    free
        Whether the damping is off.
    """
    damping = 0.0 if free else _ROLLING_DAMPING_1_S
    body.rigid.linear_damping = damping
    body.rigid.angular_damping = damping


def new_world(config: ScenesConfig, render: bool) -> sapien.Scene:
    """Make a world with an empty table under gravity.

    Parameters
    ----------
    config
        Section scenes: table and time step.
    render
        Whether the world has lights and visible shapes.

    Returns
    -------
    The world.

    Raises
    ------
    MachineError
        ``render`` is set and no Vulkan driver can render.
    """
    sapien.physx.set_scene_config(
        gravity=np.array(_GRAVITY_M_S2),
        enable_pcm=True,
        enable_tgs=True,
        enable_enhanced_determinism=True,
        cpu_workers=0,
    )
    physics = sapien.physx.PhysxCpuSystem()
    systems = [physics, new_render_system()] if render else [physics]
    world = sapien.Scene(systems)
    world.timestep = config.timestep_s
    half_size = [config.table_side_m / 2, config.table_side_m / 2, _TABLE_THICKNESS_M / 2]
    below = sapien.Pose([0.0, 0.0, -_TABLE_THICKNESS_M / 2])
    table = sapien.Entity()
    table.name = "table"
    rigid = sapien.physx.PhysxRigidStaticComponent()
    rigid.attach(_set_offsets(sapien.physx.PhysxCollisionShapeBox(half_size, _material(config))))
    table.add_component(rigid)
    if render:
        table.add_component(appearance.table_visual(half_size))
        appearance.add_lights(world, config.table_side_m)
    table.pose = below
    world.add_entity(table)
    return world


def add_body(
    world: sapien.Scene,
    catalogue_object: CatalogueObject,
    world_from_object: Float[np.ndarray, "4 4"],
    body_id: int,
    colour: tuple[float, float, float],
    config: ScenesConfig,
) -> Body:
    """Add an object to the world, at rest.

    It collides by its convex parts, has the catalogue's mass and inertia, and shows its true mesh
    where the world renders.

    Parameters
    ----------
    world
        The world.
    catalogue_object
        The object.
    world_from_object
        Its pose, shape (4, 4).
    body_id
        Segmentation id, from 1, unique in the world.
    colour
        Linear RGB in [0, 1].
    config
        Section scenes: friction.

    Returns
    -------
    The body.
    """
    if body_id < 1:
        raise ValueError(f"body ids start at 1, got {body_id}")
    material = _material(config)
    rigid = sapien.physx.PhysxRigidDynamicComponent()
    for part in catalogue_object.convex_parts:
        shape = sapien.physx.PhysxCollisionShapeConvexMesh(
            _float32(part), scale=[1.0, 1.0, 1.0], material=material
        )
        rigid.attach(_set_offsets(shape))
    moments, axes = _principal_axes(catalogue_object.inertia_kg_m2)
    rigid.mass = catalogue_object.mass_kg
    rigid.cmass_local_pose = sapien_pose(axes)
    rigid.inertia = moments
    rigid.max_depenetration_velocity = _DEPENETRATION_M_S
    rigid.linear_damping = _ROLLING_DAMPING_1_S
    rigid.angular_damping = _ROLLING_DAMPING_1_S
    rigid.solver_position_iterations = _POSITION_ITERATIONS
    rigid.solver_velocity_iterations = _VELOCITY_ITERATIONS
    entity = sapien.Entity()
    entity.name = body_name(body_id)
    entity.add_component(rigid)
    if _renders(world):
        entity.add_component(appearance.mesh_visual(catalogue_object.mesh, colour))
    entity.pose = sapien_pose(world_from_object)
    world.add_entity(entity)
    return Body(body_id, entity, rigid)


def add_wall(
    world: sapien.Scene, centre_m: list[float], half_size_m: list[float], config: ScenesConfig
) -> sapien.Entity:
    """An upright box that nothing moves, to hold a pile together while it is dropped."""
    rigid = sapien.physx.PhysxRigidStaticComponent()
    rigid.attach(_set_offsets(sapien.physx.PhysxCollisionShapeBox(half_size_m, _material(config))))
    wall = sapien.Entity()
    wall.name = "wall"
    wall.add_component(rigid)
    wall.pose = sapien.Pose(centre_m)
    world.add_entity(wall)
    return wall


def body_name(body_id: int) -> str:
    """Name of a body's entity; `body_id_of` reads it back."""
    return f"body {body_id}"


def body_id_of(entity: sapien.Entity) -> int:
    """Segmentation id of an entity: what `add_body` was given, 0 for everything else."""
    kind, _, number = entity.name.partition(" ")
    return int(number) if kind == "body" and number.isdecimal() else TABLE_BODY_ID


def sapien_pose(a_from_b: Float[np.ndarray, "4 4"]) -> sapien.Pose:
    """SAPIEN's float32 pose of a 4x4 matrix."""
    position_m, quaternion_wxyz = position_quaternion(a_from_b)
    return sapien.Pose(position_m, quaternion_wxyz)


def pose_matrix(pose: sapien.Pose) -> Float[np.ndarray, "4 4"]:
    """4x4 matrix of SAPIEN's pose, in float64."""
    return pose_from(np.asarray(pose.p, np.float64), np.asarray(pose.q, np.float64))


def _renders(world: sapien.Scene) -> bool:
    """Whether the world has a render system: SAPIEN raises where there is none."""
    try:
        world.get_render_system()
    except RuntimeError:
        return False
    return True


def _material(config: ScenesConfig) -> sapien.physx.PhysxMaterial:
    return sapien.physx.PhysxMaterial(config.friction, config.friction, 0.0)


def _set_offsets(shape: sapien.physx.PhysxCollisionShape) -> sapien.physx.PhysxCollisionShape:
    shape.contact_offset = _CONTACT_OFFSET_M
    shape.rest_offset = _REST_OFFSET_M
    return shape


def _principal_axes(
    inertia_kg_m2: Float[np.ndarray, "3 3"],
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "4 4"]]:
    """Principal moments and object_from_principal of an inertia tensor about the origin."""
    moments, axes = np.linalg.eigh(inertia_kg_m2)
    if np.linalg.det(axes) < 0:
        axes[:, 2] = -axes[:, 2]
    object_from_principal = np.eye(4)
    object_from_principal[:3, :3] = axes
    return moments, object_from_principal


@lru_cache(maxsize=4096)
def _float32(part: Mesh) -> Float[np.ndarray, "n 3"]:
    return np.ascontiguousarray(part.vertices_m, dtype=np.float32)
