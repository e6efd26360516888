"""Where things stand: a frame multiplies the subtree under its root prim over the copies of it."""

import numpy as np
from pxr import UsdGeom


class Moment:
    """A time, with what has been computed for it."""

    def __init__(self, time):
        self.time = time
        self._transforms = UsdGeom.XformCache(time)
        self._memo = {}

    def transform(self, prim, root):
        """From the prim's space to the root's, or to the world when root is None: (4, 4). True: to the world all the
        same, because something in between resets the transform stack."""
        if root is None:
            return np.array(self._transforms.GetLocalToWorldTransform(prim)), False
        matrix, resets = self._transforms.ComputeRelativeTransform(prim, root)
        return np.array(matrix), resets

    def value(self, attribute):
        """Where time samples are blocked, the schema's fallback: as for an attribute without any."""
        value = attribute.Get(self.time)
        if value is None:
            value = attribute.GetPrim().GetPrimDefinition().GetAttributeFallbackValue(attribute.GetName())
        return value

    def once(self, owner, compute):
        if owner not in self._memo:
            self._memo[owner] = compute()
        return self._memo[owner]


class Frame:
    """The stage itself: one copy of everything, at the world's origin."""

    root = None
    varying = False  # matrices, their number or visibility may vary with time

    def matrices(self, moment):
        """From the root prim's space to the world, once per copy: (n, 4, 4)."""
        return np.eye(4)[None]

    def origins(self, moment):
        """The same from the world in which the root prim stands: what resets the transform stack starts there."""
        return np.eye(4)[None]

    def places(self, prim, moment):
        """From the prim's space to the world, once per copy: (n, 4, 4)."""
        own, resets = moment.transform(prim, self.root)
        return own @ (self.origins(moment) if resets else self.matrices(moment))

    def copies(self, moment):
        """How many there are, without making their matrices."""
        return 1

    def visible(self, moment):
        """(n,) of bool."""
        return np.ones(1, bool)

    def names(self, moment):
        """Of each copy, the path that takes the place of the root prim's."""
        return [""]

    def suffix(self, prim):
        path = str(prim.GetPath())
        return path if self.root is None else path[len(str(self.root.GetPath())):]


class InstanceFrame(Frame):
    """Instanceable prims that share a prototype; the first one's proxies stand for all."""

    def __init__(self, parent, members):
        """members: (prim, moving, switches) of each instance."""
        self.parent = parent
        self.members = members
        self.root = members[0][0]
        self.varying = parent.varying or any(moving or switches for _, moving, switches in members)

    def matrices(self, moment):
        return moment.once((self, "matrices"), lambda: np.stack(
            [self.parent.places(prim, moment) for prim, _, _ in self.members], axis=1).reshape(-1, 4, 4))

    def copies(self, moment):
        return self.parent.copies(moment) * len(self.members)

    def origins(self, moment):
        return np.repeat(self.parent.origins(moment), len(self.members), axis=0)

    def visible(self, moment):
        return moment.once((self, "visible"), lambda: every(
            self.parent.visible(moment), np.array([shown(s, moment) for _, _, s in self.members])))

    def names(self, moment):
        return [outer + self.parent.suffix(prim) for outer in self.parent.names(moment) for prim, _, _ in self.members]


class PointInstanceFrame(Frame):
    """The instances of one prototype of a PointInstancer."""

    def __init__(self, instances, number):
        self.instances = instances
        self.parent = instances.parent
        self.number = number
        self.root = instances.prototypes[number]
        self.varying = instances.varying

    def _chosen(self, moment):
        numbers, matrices, visible = self.instances.sample(moment)
        chosen = np.flatnonzero(numbers == self.number)
        return chosen, matrices[chosen], visible[chosen]

    def copies(self, moment):
        return self.parent.copies(moment) * np.count_nonzero(self.instances.sample(moment)[0] == self.number)

    def matrices(self, moment):
        return moment.once((self, "matrices"), lambda: product(
            self.parent.places(self.instances.prim, moment), self._chosen(moment)[1]))

    def origins(self, moment):
        """Prototypes move with their instances."""
        return np.linalg.inv(moment.transform(self.root, None)[0]) @ self.matrices(moment)

    def visible(self, moment):
        own = self._chosen(moment)[2] & shown(self.instances.switches, moment)
        return every(self.parent.visible(moment), own)

    def names(self, moment):
        suffix = self.parent.suffix(self.instances.prim)
        own = self._chosen(moment)[0].tolist()
        return [f"{outer}{suffix}[{i}]" for outer in self.parent.names(moment) for i in own]


class PointInstances:
    """The checked arrays of one PointInstancer."""

    ARRAYS = ("protoIndices", "positions", "orientations", "orientationsf", "scales", "invisibleIds", "ids")

    def __init__(self, prim, parent, moving, switches, warn):
        self.prim = prim
        self.parent = parent
        self.switches = switches
        self._warn = warn
        self._instancer = UsdGeom.PointInstancer(prim)
        targets = self._instancer.GetPrototypesRel().GetForwardedTargets()
        self.prototypes = [prim.GetStage().GetPrimAtPath(path) for path in targets]
        arrays = [prim.GetAttribute(name) for name in self.ARRAYS]
        roots = [UsdGeom.Xformable(root) for root in self.prototypes if root and root.IsA(UsdGeom.Xformable)]
        self.varying = bool(moving or switches or parent.varying
                            or any(array and array.ValueMightBeTimeVarying() for array in arrays)
                            or any(root.TransformMightBeTimeVarying() for root in roots))

    def sample(self, moment):
        """Prototype number (n,), matrix to the instancer's space (n, 4, 4), visible (n,)."""
        return moment.once(self, lambda: self._sample(moment.time))

    def _sample(self, time):
        numbers = self._instancer.GetProtoIndicesAttr().Get(time)
        numbers = np.zeros(0, np.int32) if numbers is None else np.asarray(numbers)
        exists = np.array([bool(root) for root in self.prototypes] + [False])
        known = exists[np.where((numbers >= 0) & (numbers < len(self.prototypes)), numbers, -1)]
        if not known.all():
            self._warn(self.prim.GetPath(), "instances name no prototype that exists: left out")
        own = self._instance_transforms(time)
        if len(own) != len(numbers) or not len(numbers):
            self._warn(self.prim.GetPath(), "a point instancer without instances, or with arrays that differ in length,"
                                            " is left out")
            return np.zeros(0, np.int32), np.zeros((0, 4, 4)), np.zeros(0, bool)
        roots = np.stack([root_transform(root, time) for root in self.prototypes] + [np.eye(4)])
        mask = self._instancer.ComputeMaskAtTime(time)  # empty: all
        visible = np.array(mask, bool) if len(mask) == len(numbers) else np.ones(len(numbers), bool)
        return np.where(known, numbers, -1), roots[np.where(known, numbers, -1)] @ own, visible

    def _instance_transforms(self, time):
        """Prototype roots' transforms excluded: USD would index out of range with bad protoIndices."""
        return np.asarray(self._instancer.ComputeInstanceTransformsAtTime(
            time, time, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask))


class Placement:
    """One asset wherever its prim stands."""

    def __init__(self, asset, prim, frame, moving, switches, materials=(), local=None):
        """asset, materials (by subset): numbers into the stage's lists. local: (4, 4), applied first."""
        self.asset = asset
        self.materials = list(materials)
        self.path = str(prim.GetPath())
        self.varying = bool(moving or switches or frame.varying)
        self._prim = prim
        self._frame = frame
        self._switches = switches
        self._local = np.eye(4) if local is None else local

    def sample(self, moment):
        """Matrix to the world (n, 4, 4), visible (n,), and the name of a copy that is hidden because its transform is
        singular or not finite, or ""."""
        matrices = self._local @ self._frame.places(self._prim, moment)
        visible = self._frame.visible(moment) & shown(self._switches, moment)
        usable = np.isfinite(matrices).all(axis=(1, 2))
        matrices[~usable] = np.eye(4)
        linear = matrices[:, :3, :3]
        usable &= np.abs(np.linalg.det(linear)) > 1e-12 * np.prod(np.linalg.norm(linear, axis=2), axis=1)
        unusable = "" if usable.all() else self.names(moment)[np.argmin(usable)]
        return np.ascontiguousarray(matrices), visible & usable, unusable

    def copies(self, moment):
        return self._frame.copies(moment)

    def names(self, moment):
        suffix = self._frame.suffix(self._prim)
        return [name + suffix for name in self._frame.names(moment)]


def shown(switches, moment):
    """Whether none of the visibility attributes says invisible."""
    return all(switch.Get(moment.time) != UsdGeom.Tokens.invisible for switch in switches)


def product(outer, inner):
    """Every inner (m, 4, 4) in every outer (n, 4, 4): (n * m, 4, 4)."""
    return (inner[None] @ outer[:, None]).reshape(-1, 4, 4)


def every(outer, inner):
    """Visibility in the order of `product`."""
    return (outer[:, None] & inner[None]).reshape(-1)


def root_transform(root, time):
    if not root or not root.IsA(UsdGeom.Xformable):
        return np.eye(4)
    return np.array(UsdGeom.Xformable(root).GetLocalTransformation(time))
