"""Image files and the measures by which pictures are compared. Images are float arrays (height, width, 3), linear."""

from pathlib import Path

import numpy as np

# Added to the squared reference in relMSE, (W/(m^2 sr))^2: keeps pixels darker than 0.1 from ruling the mean.
RELMSE_EPSILON = 1e-2


# ---- files -------------------------------------------------------------------------------------

def read_image(path):
    """float32 (height, width, channels) of a .pfm, or of whatever OpenImageIO reads; row 0 at the top."""
    path = Path(path)
    if path.suffix == ".pfm":
        return read_pfm(path)
    import OpenImageIO as oiio

    buffer = oiio.ImageBuf(str(path))
    if buffer.has_error:
        raise ValueError(f"{path}: {buffer.geterror()}")
    return np.asarray(buffer.get_pixels(oiio.FLOAT), dtype=np.float32)


def read_pfm(path):
    """Portable float map: rows from the bottom up, a negative scale for little endian."""
    with open(path, "rb") as file:
        kind = file.readline().strip()
        width, height = map(int, file.readline().split())
        order = "<" if float(file.readline()) < 0 else ">"
        channels = {b"PF": 3, b"Pf": 1}[kind]
        data = np.frombuffer(file.read(), dtype=order + "f4")
    return data.reshape(height, width, channels)[::-1].astype(np.float32)


def write_pfm(path, image):
    """The inverse of read_pfm, for three channels."""
    height, width, _ = image.shape
    with open(path, "wb") as file:
        file.write(f"PF\n{width} {height}\n-1.0\n".encode())
        file.write(np.ascontiguousarray(image[::-1], dtype="<f4").tobytes())


def write_image(path, image, channels=()):
    """float32, ZIP compressed where the format can."""
    import OpenImageIO as oiio

    image = np.ascontiguousarray(image, dtype=np.float32)
    spec = oiio.ImageSpec(image.shape[1], image.shape[0], image.shape[2], oiio.FLOAT)
    if channels:
        spec.channelnames = channels
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


def block_t(images, reference, size, mask=None):
    """Student's t of the mean residual in blocks of size x size pixels, and its degrees of freedom.

    images: (n, height, width, channels), independent, as are their pixels; with an exact reference the n size^2 residuals
    of a block have mean 0, so their own spread tells how far their mean may be from it. Blocks that touch a pixel outside
    `mask` are left out. Returns (blocks, channels), n size^2 - 1.
    """
    residuals = _wide(images) - _wide(reference)
    count, height, width, channels = residuals.shape
    rows, columns = height // size, width // size
    residuals = residuals[:, :rows * size, :columns * size].reshape(count, rows, size, columns, size, channels)
    residuals = residuals.transpose(1, 3, 0, 2, 4, 5).reshape(rows * columns, count * size * size, channels)
    if mask is not None:
        whole = mask[:rows * size, :columns * size].reshape(rows, size, columns, size).all(axis=(1, 3)).ravel()
        residuals = residuals[whole]
    error = residuals.std(axis=1, ddof=1) / np.sqrt(residuals.shape[1])
    return residuals.mean(axis=1) / np.maximum(error, 1e-12), residuals.shape[1] - 1


def slope(samples, errors):
    """Exponent of error ~ samples^slope, by least squares on logarithms."""
    return float(np.polyfit(np.log(samples), np.log(errors), 1)[0])


def student_tail(t, degrees):
    """P(T > t) of Student's t, t >= 0. t = tan(a) sqrt(degrees) turns the density into cos(a)^(degrees - 1)."""
    tail = np.linspace(np.arctan(t / np.sqrt(degrees)), np.pi / 2, 20001)
    whole = np.linspace(-np.pi / 2, np.pi / 2, 20001)
    return float(np.trapezoid(np.cos(tail) ** (degrees - 1), tail) / np.trapezoid(np.cos(whole) ** (degrees - 1), whole))


def _wide(image):
    return np.asarray(image, dtype=np.float64)


def _masked(values, mask):
    return values if mask is None else values[mask]
