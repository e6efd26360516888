"""Walks an OpenUSD stage and hands out plain records and arrays, which the C++ side of the plugin turns into a scene.

Nothing here knows the engine; nothing on the C++ side knows USD. The border is `Stage` (stage.py):

    materials   list of objects with read(moment) -> dict of Material fields
    assets      list of objects with kind, path, read(moment) -> dict: meshes, shapes, spheres, lights, cameras
    placements  list of Placement: which asset stands where, how often, with which materials
    update(t)   what differs at another time

Matrices are USD's: row vectors, double precision, shape (n, 4, 4); in memory that is GLM's column-major layout.
"""

from .diagnostics import StageError
from .stage import Stage

__all__ = ["Stage", "StageError"]
