"""Image files and the measures by which pictures are compared. Images are float arrays (height, width, 3), linear."""

import functools
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


def difference(image, reference):
    """Signed relative difference of luminance: white at 0, red too bright, blue too dark, full colour at 10%."""
    a, b = luminance(image), luminance(reference)
    share = np.clip((a - b) / (0.1 * np.sqrt(b**2 + RELMSE_EPSILON)), -1, 1)
    fade = 1 - np.abs(share)
    color = np.stack([np.where(share > 0, 1, fade), fade, np.where(share < 0, 1, fade)], axis=-1)
    return np.round(255 * color).astype(np.uint8)


# ---- measures ----------------------------------------------------------------------------------

def luminance(image):
    """Rec. 709, (height, width)."""
    return np.asarray(image, dtype=np.float64) @ [0.2126, 0.7152, 0.0722]


def mse(image, reference, mask=None):
    return float(_masked((_wide(image) - _wide(reference)) ** 2, mask).mean())


def display_mse(image, reference):
    """mse of what a display shows: radiance clipped to [0, 1]. The paper compares pictures; unclipped, the few pixels on a
    lamp's edge outweigh all others."""
    return mse(np.clip(image, 0, 1), np.clip(reference, 0, 1))


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


def falling_errors(frames, first, second, samples):
    """relMSE of the mean of n frames for each n of `samples`, over all disjoint groups of n. `first` and `second` are independent
    unbiased references: the product of the differences from each has the squared error as its expectation, without their noise."""
    frames, first, second = (_wide(x) for x in (frames, first, second))
    weight = 1 / (((first + second) / 2) ** 2 + RELMSE_EPSILON)
    sums = np.concatenate([np.zeros_like(frames[:1]), np.cumsum(frames, axis=0)])
    errors = []
    for n in samples:
        means = (sums[n::n] - sums[:-n:n][:len(sums[n::n])]) / n
        errors.append(float(((means - first) * (means - second) * weight).mean()))
    return errors


def slope(samples, errors):
    """Exponent of error ~ samples^slope, by least squares on logarithms."""
    return float(np.polyfit(np.log(samples), np.log(errors), 1)[0])


def student_tail(t, degrees):
    """P(T > t) of Student's t, t >= 0. t = tan(a) sqrt(degrees) turns the density into cos(a)^(degrees - 1)."""
    tail = np.linspace(np.arctan(t / np.sqrt(degrees)), np.pi / 2, 20001)
    whole = np.linspace(-np.pi / 2, np.pi / 2, 20001)
    return float(np.trapezoid(np.cos(tail) ** (degrees - 1), tail) / np.trapezoid(np.cos(whole) ** (degrees - 1), whole))


@functools.cache
def student_quantile(chance, degrees):
    """t with P(|T| < t) = chance."""
    low, high = 0.0, 1e4
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if 2 * student_tail(middle, degrees) > 1 - chance else (low, middle)
    return high


def interval(values, chance=0.95):
    """(mean, half width of its confidence interval) of independent values; the width of a single value is infinite."""
    if len(values) < 2:
        return float(np.mean(values)), np.inf
    mean, error = confidence(values)
    return mean, student_quantile(chance, len(values) - 1) * error


def squared_errors(image, reference):
    """Per pixel, what mse averages."""
    return ((_wide(image) - _wide(reference)) ** 2).mean(axis=-1)


def relative_squared_errors(image, reference):
    """Per pixel, what relmse averages."""
    b = _wide(reference)
    return ((_wide(image) - b) ** 2 / (b**2 + RELMSE_EPSILON)).mean(axis=-1)


def bootstrap(errors, chance=0.95, block=6, draws=400):
    """(mean, low, high) of a map of errors (height, width): the interval is that of resampled blocks of pixels, as wide as
    errors are alike among neighbours (Efron 1979)."""
    blocks = block_means(errors[..., None], block).ravel()
    means = np.random.default_rng(1).choice(blocks, (draws, len(blocks))).mean(axis=1)
    low, high = np.quantile(means, [(1 - chance) / 2, (1 + chance) / 2])
    return float(errors.mean()), float(low), float(high)


def bias(image, reference, block=None):
    """(mean radiance over the reference's - 1, half width of its 95% interval); the interval is that of the residuals' mean over
    blocks of pixels, a sixth of the height by default, which are independent where noise reaches no farther."""
    block = block or max(1, len(reference) // 6)
    residuals = block_means(_wide(image) - _wide(reference), block).mean(axis=-1).ravel()
    level = _wide(reference).mean()
    return float(_wide(image).mean() / level - 1), interval(residuals)[1] / level


def flip(image, reference):
    """Mean HDR-FLIP (Andersson et al. 2021) at the program's own distance and exposures, or None without flip-evaluator."""
    try:
        import flip_evaluator
    except ImportError:
        return None
    pictures = (np.ascontiguousarray(np.maximum(p, 0), dtype=np.float32) for p in (reference, image))
    return float(flip_evaluator.evaluate(*pictures, "HDR", applyMagma=False)[1])


def darkening(image, single):
    """What stays of the brightness of `single`: (the paper's, that of the means), both 1 where nothing is lost.

    The paper averages the quotients of pixels where `single` is not black; noise in the divisor raises that mean
    (E[1/x] > 1/E[x]), so the second is the one to judge by.
    """
    a, b = luminance(image), luminance(single)
    lit = b > 0
    return float((a[lit] / b[lit]).mean()), float(a.mean() / b.mean())


def class_bias(classes, references):
    """Signed error of each path class's mean, relative, with its interval: {name: bias}; only of those that have light."""
    lit = {name for name in references if _wide(references[name]).mean() > 0}
    return {name: bias(classes[name], references[name]) for name in references if name in lit and name in classes}


def flicker(frames):
    """Standard deviation of a pixel from frame to frame, relative to the mean: frames (n, height, width, 3), camera and
    scene at rest, where reprojection is the identity. Slow drift cancels in the differences."""
    frames = _wide(frames)
    return float(np.sqrt((np.diff(frames, axis=0) ** 2).mean() / 2) / frames.mean())


def frames_until(means, change, share=0.9, settled=8):
    """Frames after index `change` until the mean stays within 1 - share of the whole step of its final level, which is
    that of the last `settled` frames; None without a step."""
    means = _wide(means)
    before, after = means[:change].mean(), means[-settled:].mean()
    if not abs(after - before) > 1e-9 * abs(after):
        return None
    off = np.abs(means[change:] - after) > (1 - share) * abs(after - before)
    return int(np.nonzero(off)[0][-1]) + 1 if off.any() else 0


def drift(means):
    """Relative change of the level between the first and the last third of a series that should be level."""
    means = _wide(means)
    third = len(means) // 3
    return float(means[-third:].mean() / means[:third].mean() - 1)


def nonfinite(image):
    return int(np.count_nonzero(~np.isfinite(image)))


def _wide(image):
    return np.asarray(image, dtype=np.float64)


def _masked(values, mask):
    return values if mask is None else values[mask]
