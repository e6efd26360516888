"""Image files and the measures by which pictures are compared. Images are float arrays (height, width, 3), linear."""

from pathlib import Path

import numpy as np

# Added to the squared reference in relMSE, (W/(m^2 sr))^2: keeps pixels darker than 0.1 from ruling the mean.
RELMSE_EPSILON = 1e-2


# ---- files -------------------------------------------------------------------------------------

def read_image(path):
    """float32 (height, width, 3) of a .pfm, or of whatever OpenImageIO reads; row 0 at the top."""
    path = Path(path)
    if path.suffix == ".pfm":
        return read_pfm(path)
    import OpenImageIO as oiio

    buffer = oiio.ImageBuf(str(path))
    if buffer.has_error:
        raise ValueError(f"{path}: {buffer.geterror()}")
    pixels = np.asarray(buffer.get_pixels(oiio.FLOAT), dtype=np.float32)
    return pixels[..., :3] if pixels.shape[2] >= 3 else pixels


def read_pfm(path):
    """Portable float map: rows from the bottom up, a negative scale for little endian."""
    with open(path, "rb") as file:
        kind = file.readline().strip()
        width, height = map(int, file.readline().split())
        order = "<" if float(file.readline()) < 0 else ">"
        channels = {b"PF": 3, b"Pf": 1}[kind]
        data = np.frombuffer(file.read(), dtype=order + "f4")
    return data.reshape(height, width, channels)[::-1].astype(np.float32)


def write_image(path, image):
    """float32, ZIP compressed where the format can."""
    import OpenImageIO as oiio

    image = np.ascontiguousarray(image, dtype=np.float32)
    spec = oiio.ImageSpec(image.shape[1], image.shape[0], image.shape[2], oiio.FLOAT)
    spec.attribute("compression", "zip")
    output = oiio.ImageOutput.create(str(path))
    if not output or not output.open(str(path), spec) or not output.write_image(image):
        raise OSError(f"{path}: {oiio.geterror()}")
    output.close()


def to_display(image, exposure=0.0):
    """uint8 sRGB with plain clipping, for people to look at."""
    linear = np.clip(np.nan_to_num(np.asarray(image, dtype=np.float64) * 2.0**exposure), 0, 1)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * srgb).astype(np.uint8)


def write_png(path, pixels):
    """`pixels`: uint8 (height, width, 3)."""
    import OpenImageIO as oiio

    pixels = np.ascontiguousarray(pixels)
    buffer = oiio.ImageBuf(oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.UINT8))
    buffer.set_pixels(oiio.ROI(), pixels)
    if not buffer.write(str(path)):
        raise OSError(f"{path}: {buffer.geterror()}")


# ---- measures ----------------------------------------------------------------------------------

def luminance(image):
    """Rec. 709, (height, width)."""
    return np.asarray(image, dtype=np.float64) @ [0.2126, 0.7152, 0.0722]


def mse(image, reference, mask=None):
    return float(_masked((_wide(image) - _wide(reference)) ** 2, mask).mean())


def relmse(image, reference, mask=None):
    """mean((a - b)^2 / (b^2 + RELMSE_EPSILON)) over pixels and channels."""
    a, b = _wide(image), _wide(reference)
    return float(_masked((a - b) ** 2 / (b**2 + RELMSE_EPSILON), mask).mean())


def mean_ratio(image, reference, mask=None):
    """Mean radiance of `image` over that of `reference`."""
    return float(_masked(_wide(image), mask).mean() / _masked(_wide(reference), mask).mean())


def confidence(values):
    """(mean, standard error) of independent values."""
    values = np.asarray(values, dtype=np.float64)
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values)))


def block_means(image, size):
    """Means over size x size pixels, the ragged edge left out: (rows, columns, channels)."""
    image = _wide(image)
    rows, columns = image.shape[0] // size, image.shape[1] // size
    return image[:rows * size, :columns * size].reshape(rows, size, columns, size, -1).mean(axis=(1, 3))


def block_z(images, reference, size, reference_variance=None):
    """z of each block of the mean of independent `images` against `reference`, (rows, columns, channels).

    reference_variance: variance of each block's mean in the reference (same shape), or None where it is negligible.
    """
    blocks = np.stack([block_means(i, size) for i in images])
    variance = blocks.var(axis=0, ddof=1) / len(blocks)
    if reference_variance is not None:
        variance = variance + reference_variance
    difference = blocks.mean(axis=0) - block_means(reference, size)
    return difference / np.sqrt(np.maximum(variance, 1e-30))


def slope(samples, errors):
    """Exponent of error ~ samples^slope, by least squares on logarithms."""
    return float(np.polyfit(np.log(samples), np.log(errors), 1)[0])


def student_quantile(probability, degrees):
    """Quantile of Student's t, by bisection on its density's integral: no SciPy needed for one number."""
    if probability < 0.5:
        return -student_quantile(1 - probability, degrees)
    # t = tan(a) sqrt(n) turns the density into cos(a)^(n-1) on (-pi/2, pi/2).
    angles = np.linspace(-np.pi / 2, np.pi / 2, 400001)
    density = np.cos(angles) ** (degrees - 1)
    cumulative = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
    angle = np.interp(probability, cumulative / cumulative[-1], angles)
    return float(np.tan(angle) * np.sqrt(degrees))


def _wide(image):
    return np.asarray(image, dtype=np.float64)


def _masked(values, mask):
    return values if mask is None else values[mask]
