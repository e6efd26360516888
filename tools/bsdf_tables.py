#!/usr/bin/env python3
"""Writes engine/render/bsdf_tables_data.inc: microfacet energies on the grid of shaders/shared/bsdf_tables.h.

Each entry integrates single scattering by the very sampling that the shaders use: visible GGX normals (Dupuy & Benyoub
2023), weight G2 / G1 with height-correlated Smith masking. Midpoint rule in azimuth, Gauss-Legendre in elevation.
Needs NumPy; takes about a minute.
"""
import pathlib
import numpy as np

GGX, DIELECTRIC, ETAS, COATED, COATS = 32, 24, 25, 16, 8


def smithLambda(w, alpha):
    z2 = w[..., 2] ** 2
    return 0.5 * (np.sqrt(1 + alpha**2 * np.maximum(1 - z2, 0) / np.maximum(z2, 1e-30)) - 1)


def visibleNormals(wo, alpha, u, v):
    up = wo * [alpha, alpha, 1]
    up /= np.linalg.norm(up)
    z = (1 - v) * (1 + up[2]) - up[2]
    s = np.sqrt(np.maximum(1 - z * z, 0))
    phi = 2 * np.pi * u
    h = (np.stack([s * np.cos(phi), s * np.sin(phi), z], -1) + up) * [alpha, alpha, 1]
    return h / np.linalg.norm(h, axis=-1, keepdims=True)


def fresnel(cosine, eta):
    cosT = np.sqrt(np.maximum(1 - (1 - cosine**2) / eta**2, 0))
    parallel = (eta * cosine - cosT) / (eta * cosine + cosT)
    perpendicular = (cosine - eta * cosT) / (cosine + eta * cosT)
    return 0.5 * (parallel**2 + perpendicular**2)


class Estimate:
    """Normals visible from elevation x^2 on a surface of roughness y, with weights and masking."""

    def __init__(self, x, y, azimuths, elevations):
        self.alpha = max(y * y, 1e-4)
        mu = max(x * x, 1e-5)
        self.wo = np.array([np.sqrt(1 - mu * mu), 0, mu])
        node, weight = np.polynomial.legendre.leggauss(elevations)
        u, v = np.meshgrid((np.arange(azimuths) + 0.5) / azimuths, node / 2 + 0.5, indexing="ij")
        self.weight = np.broadcast_to(weight / (2 * azimuths), u.shape)
        self.h = visibleNormals(self.wo, self.alpha, u, v)
        self.cosine = np.clip(self.h @ self.wo, 1e-12, 1)

    def share(self, wi, upper):
        """Of the light leaving along wi, what is neither masked nor on the wrong side."""
        lo, li = smithLambda(self.wo, self.alpha), smithLambda(wi, self.alpha)
        return np.where((wi[..., 2] > 0) == upper, (1 + lo) / (1 + lo + li), 0) * self.weight

    def reflection(self):
        return 2 * self.cosine[..., None] * self.h - self.wo

    def reflected(self):
        return self.share(self.reflection(), True)

    def refracted(self, eta):
        cosT = np.sqrt(np.maximum(1 - (1 - self.cosine**2) / eta**2, 0))
        return self.share((self.cosine / eta - cosT)[..., None] * self.h - self.wo / eta, False)


def ggx(x, y):
    e = Estimate(x, y, 96, 192)
    r, f = e.reflected(), (1 - e.cosine) ** 5
    return 1 - r.sum(), (r * f).sum()


def coated(x, y, coats):
    """`coats`: for each coat what it reflects with factor (1 - cos)^5, over x."""
    e = Estimate(x, y, 96, 192)
    r, f = e.reflected(), (1 - e.cosine) ** 5
    axis, xi = np.linspace(0, 1, GGX), np.sqrt(np.clip(e.reflection()[..., 2], 0, 1))
    taken = [r * np.maximum(np.interp(xi, axis, coat) - np.interp(x, axis, coat), 0) for coat in coats]
    return [((t * (1 - f)).sum(), (t * f).sum()) for t in taken]


def dielectric(x, y, z):
    ratio = z**3 / 2
    eta = (1 + ratio) / (1 - ratio)
    e = Estimate(x, y, 48, 96)
    f = fresnel(e.cosine, eta)
    return 1 - (f * e.reflected()).sum() - ((1 - f) * e.refracted(eta)).sum()


def words(values, bits):
    top = 2**bits - 1
    flat = np.rint(np.clip(np.asarray(values).ravel(), 0, 1) * top).astype(int)
    return "\n".join(",".join(str(v) for v in flat[i : i + 28]) + "," for i in range(0, flat.size, 28))


def main():
    axis = np.linspace(0, 1, GGX)
    entries = np.array([[ggx(x, y) for x in axis] for y in axis])
    coats = [[np.interp(z, axis, column) for column in entries[..., 1].T] for z in np.linspace(0, 1, COATS)]
    coarse = np.linspace(0, 1, COATED)
    taken = np.array([[coated(x, y, coats) for x in coarse] for y in coarse])
    small = np.linspace(0, 1, DIELECTRIC)
    lost = [[[dielectric(x, y, z) for x in small] for y in small] for z in np.linspace(-1, 1, ETAS)]

    def pair(values):
        return "\n".join(f"{{\n{words(values[..., i], 16)}\n}}," for i in range(2))

    path = pathlib.Path(__file__).resolve().parent.parent / "engine/render/bsdf_tables_data.inc"
    path.write_text(
        "// Made by tools/bsdf_tables.py.\n"
        f"constexpr uint16_t kGgx[2][{GGX * GGX}] = {{\n{pair(entries)}\n}};\n"
        f"constexpr uint16_t kCoated[2][{COATS * COATED * COATED}] = {{\n{pair(np.moveaxis(taken, 2, 0))}\n}};\n"
        f"constexpr uint8_t kDielectricLost[] = {{\n{words(lost, 8)}\n}};\n"
    )


if __name__ == "__main__":
    main()
