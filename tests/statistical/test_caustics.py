"""Caustics by photons: agreement with path tracing, energy, invariances, moving casters."""

import numpy as np
import pytest

import harness
from trilume_bench import metrics

# Of the hybrid only what is tested here.
# Without the denoiser, which would take the mean over frames upon itself.
CAUSTICS = ("-t", "hybrid", "--denoise", "off", *(o for node in ("restir_di", "ddgi") for o in ("--disable", node)))
# A small picture with many photons.
MANY = (*CAUSTICS, "--set", "caustics.photonsPerPixel=64")

MIRROR_AND_GLASS = harness.GLASS + harness.material("Mirror", diffuseColor=(0.9, 0.8, 0.7), metallic=1, roughness=0)


def placed(text, translate="(0, 0, 0)", rotate="(0, 0, 0)", scale="(1, 1, 1)"):
    """A prim's text with its transform in place of @."""
    return text.replace("@", f"""float3 xformOp:scale = {scale}
        float3 xformOp:rotateXYZ = {rotate}
        double3 xformOp:translate = {translate}
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]""")


def light(kind, name, fields, **transform):
    return placed(f"""
    def {kind} "{name}"
    {{
        {fields}
        @
    }}
""", **transform)


def ball(radius, material="Glass", **transform):
    return placed(f"""
    def Sphere "Ball{material}" (prepend apiSchemas = ["MaterialBindingAPI"])
    {{
        double radius = {radius}
        rel material:binding = </World/{material}>
        @
    }}
""", **transform)


def square(name, material="Matte", **transform):
    return harness.mesh(name=name, material=material, extra=placed("@", **transform))


WALL = square("Wall", scale="(4, 4, 1)")
LIGHTS = {
    "finite": light("SphereLight", "Round", "float inputs:radius = 0.5\n        float inputs:intensity = 10",
                    translate="(4, 0, 3.3)")
    + light("RectLight", "Rect", "float inputs:width = 1\n        float inputs:height = 1.5\n"
            "        float inputs:intensity = 6\n        color3f inputs:color = (1, 0.3, 0.3)",
            translate="(3.5, 2, 4)", rotate="(-25, 30, 0)")
    + light("DiskLight", "Disk", "float inputs:radius = 0.6\n        float inputs:intensity = 6\n"
            "        color3f inputs:color = (0.3, 1, 0.3)", translate="(4, -2, 3)", rotate="(30, 45, 0)")
    + light("CylinderLight", "Tube", "float inputs:radius = 0.2\n        float inputs:length = 2\n"
            "        float inputs:intensity = 8\n        color3f inputs:color = (0.3, 0.3, 1)",
            translate="(1.6, 2.6, 3)", rotate="(0, 0, 30)")
    + square("Panel", "Glowing", translate="(3.5, -2.6, 2)", rotate="(130, 0, -30)", scale="(0.5, 0.7, 1)"),
    "infinite": light("DomeLight", "Sky", "float inputs:intensity = 0.5")
    + light("DistantLight", "Sun", "float inputs:angle = 25\n        float inputs:intensity = 8\n"
            "        color3f inputs:color = (1, 0.8, 0.4)", rotate="(0, 50, 0)"),
}


def stage(folder, *parts):
    parts = (harness.CAMERA, MIRROR_AND_GLASS, harness.matte(0.8), harness.matte(0, 5, name="Glowing"), *parts)
    return harness.write_stage(folder / "stage.usda", *parts)


def caustic(render, path, *flags, count, **keywords):
    """The caustic AOVs of `count` independent runs."""
    return np.stack([r.aovs["caustic"] for r in render.runs(path, *flags, count=count, aovs=("caustic",), **keywords)])


# ---- agreement with path tracing ---------------------------------------------------------------

@pytest.mark.parametrize("lights", LIGHTS)
def test_seen_directly_there_is_no_bias(render, tmp_path, lights):
    """The wall only is in view; a glass ball and a mirror ball beside it cast caustics onto it."""
    path = stage(tmp_path, WALL, LIGHTS[lights], ball(0.5, translate="(2.1, 0, 1.5)"),
                 ball(0.3, "Mirror", translate="(-2.3, 0.4, 1)"))
    photons = caustic(render, path, *MANY, "--spp", 32, count=4)
    paths = caustic(render, path, "-t", "pathtrace", "--spp", 4096 if harness.FULL else 768, count=4)
    a, b = photons.mean(axis=(1, 2, 3)), paths.mean(axis=(1, 2, 3))
    error = np.hypot(metrics.confidence(a)[1], metrics.confidence(b)[1])
    assert error < 0.02 * b.mean()
    # Four runs: three degrees of freedom; one in a thousand.
    assert metrics.student_tail(abs(a.mean() - b.mean()) / error, 3) * 2 > 1e-3, (a, b)
    t, degrees = metrics.block_t(photons - paths, np.zeros_like(paths[0]), 3)
    assert metrics.student_tail(np.abs(t).max(), degrees) * 2 * t.size > 1e-6


def mirror_stage(folder):
    """All that is in view is seen in a mirror: a wall, and a glass ball whose caustic falls onto it."""
    return stage(folder, square("Wall", translate="(3, 0, 2)", rotate="(0, -90, 0)", scale="(3, 3, 1)"),
                 square("Plate", "Mirror", translate="(0, 0, 2)", rotate="(0, 45, 0)", scale="(1.8, 1.8, 1)"),
                 ball(0.5, translate="(1.7, -0.5, 2)"),
                 light("SphereLight", "Lamp", "float inputs:radius = 0.6\n        float inputs:intensity = 10",
                       translate="(0.2, 2.2, 2.8)"))


def test_seen_in_a_mirror_the_energy_is_right(render, tmp_path):
    """Photons are gathered around what is seen in the mirror, as wide as two pixels and less: some are lost at edges."""
    path = mirror_stage(tmp_path)
    photons = caustic(render, path, *MANY, "--spp", 32, count=2).mean()
    kernels = caustic(render, path, *MANY, "--spp", 32, "--set", "caustics.direct=kernel", count=2).mean()
    paths = caustic(render, path, "-t", "pathtrace", "--spp", 768, count=4).mean(axis=(1, 2, 3))
    mean, error = metrics.confidence(paths)
    assert error < 0.01 * mean
    assert photons == pytest.approx(mean, rel=0.03)
    assert kernels == pytest.approx(mean, rel=0.03)


@pytest.mark.parametrize(("share", "frames"), [(1, 16), (0.125, 9)])
def test_mean_over_frames_is_that_of_single_frames(render, tmp_path, share, frames):
    """A picture after frames that were not averaged rests on all of them: the same mean, far less noise. Of sixteen, eight
    are settled."""
    path = stage(tmp_path, WALL, LIGHTS["finite"], ball(0.5, translate="(2.1, 0, 1.5)"))
    alone = caustic(render, path, *MANY, "--spp", 1, count=8)
    after = caustic(render, path, *MANY, "--spp", 1, "--warmup", 15, "--set", f"caustics.settledShare={share}",
                    count=8)
    # So many whole frames in each: the variance falls as much, but for what learning where to aim adds.
    gain = alone.var(axis=0, ddof=1).mean() / after.var(axis=0, ddof=1).mean()
    assert 0.6 * frames < gain < 1.5 * frames, gain
    a, b = metrics.confidence(alone.mean(axis=(1, 2, 3))), metrics.confidence(after.mean(axis=(1, 2, 3)))
    assert abs(a[0] - b[0]) < 5 * np.hypot(a[1], b[1])


# ---- energy ------------------------------------------------------------------------------------

def test_weak_lens_lands_the_flux_that_enters_it(render, tmp_path):
    """All light that enters a ball of index 1.005 falls onto the wall: irradiance times pi r^2. It reflects 0.1%."""
    albedo, irradiance, radius = 0.8, 5.0, 0.4
    sun = light("DistantLight", "Sun", f"float inputs:angle = 0\n        float inputs:intensity = {irradiance}",
                rotate="(0, 45, 0)")
    parts = (WALL, sun, ball(radius, translate="(2.2, 0, 1.5)"), harness.CAMERA, harness.matte(albedo),
             MIRROR_AND_GLASS.replace("inputs:ior = 1.5", "inputs:ior = 1.005"))
    path = harness.write_stage(tmp_path / "lens.usda", *parts)
    picture = caustic(render, path, *MANY, "--spp", 16, count=1)[0]
    in_view = (36 / 30 * 4) * (20.25 / 30 * 4)  # square metres of the wall, which faces the camera
    flux = picture.mean() * in_view * np.pi / albedo
    assert flux == pytest.approx(irradiance * np.pi * radius**2, rel=0.005)


# ---- invariances -------------------------------------------------------------------------------

def test_same_seed_same_image_on_any_number_of_threads(render):
    """Bit for bit, splats, gathered photons, what is learned and what is remembered."""
    flags = (*CAUSTICS, "--spp", 2, "--warmup", 3, "--seed", 7)
    one = render("cornell_glass", *flags, env={"LP_NUM_THREADS": "1"}, size=(96, 54)).image
    two = render("cornell_glass", *flags, env={"LP_NUM_THREADS": "2"}, size=(96, 54)).image
    assert (one == two).all()


@pytest.mark.parametrize("factor", [1e-5, 1e5])
def test_emission_scales_the_image(render, tmp_path, factor):
    path = harness.scaled_emission("cornell_glass", tmp_path / "scaled.usda", factor)
    flags = (*CAUSTICS, "--spp", 4)
    plain, scaled = (caustic(render, s, *flags, count=1)[0] for s in ("cornell_glass", path))
    assert plain.max() > 0
    assert scaled / factor == pytest.approx(plain, rel=1e-3)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_stage_scales_without_effect(render, tmp_path, factor):
    """Photons land at the same places of a stage of any size, but for those that rounding sends elsewhere."""
    path = harness.scaled_stage("cornell_glass", tmp_path / "scaled.usda", factor)
    flags = (*CAUSTICS, "--spp", 4)
    plain, scaled = (caustic(render, s, *flags, count=1)[0] for s in ("cornell_glass", path))
    close = np.isclose(scaled, plain, rtol=1e-3, atol=1e-5).all(axis=2)
    assert close.mean() > 0.95
    assert scaled.mean() == pytest.approx(plain.mean(), rel=0.02)


# ---- change ------------------------------------------------------------------------------------

def test_no_caustic_stays_behind_a_ball_that_has_moved(render, tmp_path):
    """The ball jumps from one frame to the next: its caustic is where one is that was always there."""
    moving = ball(0.5).replace("double3 xformOp:translate = (0, 0, 0)", """double3 xformOp:translate.timeSamples = {
            1: (2.1, 0.9, 1.5), 2: (2.1, -0.9, 1.5) }""")
    lamp = light("SphereLight", "Lamp", "float inputs:radius = 0.3\n        float inputs:intensity = 30",
                 translate="(4, 0, 3.3)")
    path = stage(tmp_path, WALL, lamp, moving)
    output = tmp_path / "out.####.pfm"
    done = harness.run("render", "--progress", "off", *MANY, "--warmup", 8, "--imageWidth", 32, "--imageHeight", 18,
                       "--frames", "1:2", path, output)
    assert done.status == 0, done.stderr
    first, second = (metrics.read_image(tmp_path / f"out.{f:04d}.pfm").mean(axis=2) for f in (1, 2))
    # Mirror images of each other, up to noise; what falls on the lower half first falls on the upper half then.
    lower, upper = first[9:].sum(), first[:9].sum()
    assert max(lower, upper) > 10 * min(lower, upper)
    brighter = (lambda i: i[9:]) if lower > upper else (lambda i: i[:9])
    darker = (lambda i: i[:9]) if lower > upper else (lambda i: i[9:])
    assert darker(second).sum() == pytest.approx(brighter(first).sum(), rel=0.05)
    assert brighter(second).sum() == pytest.approx(darker(first).sum(), rel=0.2, abs=0.01 * brighter(first).sum())


# ---- cost --------------------------------------------------------------------------------------

def node(run):
    return next(n for n in run.stats["frames"][0]["nodes"] if n["name"] == "caustics")


def test_runs_where_there_is_a_caustic_only(render, tmp_path):
    assert node(render("cornell_glass", *CAUSTICS, "--spp", 1))["state"] == "run"
    plain = node(render("cornell_empty", *CAUSTICS, "--spp", 1))
    assert (plain["state"], plain["reason"]) == ("skipped", "no mirrors and no glass")
    dark = node(render(stage(tmp_path, WALL, ball(0.5)), *CAUSTICS, "--spp", 1, "--default-light", "off"))
    assert (dark["state"], dark["reason"]) == ("skipped", "no lights")


def test_photons_are_as_many_as_are_of_use(render, tmp_path):
    """A caustic out of sight gets an eighth of the limit; one in sight all of it."""
    limit = 2048
    flags = (*CAUSTICS, "--set", f"caustics.photons={limit}", "--set", "caustics.photonsPerPixel=64", "--spp", 16)
    seen = stage(tmp_path, WALL, LIGHTS["finite"], ball(0.5, translate="(2.1, 0, 1.5)"))
    assert render(seen, *flags).stats["frames"][0]["photons"] == 16 * limit
    away = tmp_path / "away"
    away.mkdir()
    behind = stage(away, square("Wall", translate="(0, 0, 9)", rotate="(0, 180, 0)", scale="(4, 4, 1)"),
                   LIGHTS["finite"], ball(0.5, translate="(0, 0, 7.5)"))
    photons = render(behind, *flags).stats["frames"][0]["photons"]
    assert limit * (16 / 8) <= photons < limit * (16 / 8 + 2)
