"""Texture files that assets name, also inside .usdz packages."""

import os
import tempfile

from pxr import Ar


class Files:
    """Paths on disk for resolved assets. What is packed is written to a temporary folder that lives as long as this."""

    def __init__(self):
        self._folder = None
        self._unpacked = {}

    def path(self, resolved):
        """None when the package has no such file."""
        if not Ar.IsPackageRelativePath(resolved):
            return resolved if os.path.isfile(resolved) else None
        if resolved not in self._unpacked:
            self._unpacked[resolved] = self._unpack(resolved)
        return self._unpacked[resolved]

    def _unpack(self, resolved):
        asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
        if not asset:
            return None
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="trilume-usdz-")
        inner = Ar.SplitPackageRelativePathInner(resolved)[1]
        path = os.path.join(self._folder.name, f"{len(self._unpacked)}-{os.path.basename(inner)}")
        with asset as opened, open(path, "wb") as file:
            file.write(opened.GetBuffer())
        return path


def find_file(asset, attribute, files, warn):
    """The path on disk of an Sdf.AssetPath; None, with a warning, when there is none."""
    prim = attribute.GetPath().GetPrimPath()
    if "<UDIM>" in asset.path:
        warn(prim, f"UDIM textures are not supported: {asset.path}: a constant is used")
        return None
    path = files.path(asset.resolvedPath) if asset.resolvedPath else None
    if path is None:
        warn(prim, f"texture not found: {asset.path}: a constant is used")
    return path
