"""The peer's half of run.sh: scenes by Mitsuba 3.

    python peer.py FOLDER

After a line that names Mitsuba, each line of standard input is answered by one:

    table SCENE PASSES SPP     renders independent passes; writes SCENE.json beside this file (the scene and, for blocks of
                               pixels, mean radiance and standard error) and FOLDER/SCENE (mean and variance of the mean
                               of each pixel: 2 x rows x columns x RGB, f64)
    render SCENE SPP SEED      renders and forgets

Variance is that between passes, so it asks nothing of the renderer.
"""
import json
import math
import pathlib
import sys

import drjit as dr
import mitsuba as mi
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
mi.set_variant("llvm_ad_rgb")
mi.set_log_level(mi.LogLevel.Warn)
dr.set_thread_count(1)

# The mesh is bitlight's shape "torus-knot" (src/world/shapes/mod.rs), made again here.
MAJOR, MINOR, TUBE, P, Q = 1.0, 0.45, 0.35, 2, 3


def knot(n, size):
    along, around = max(8 * n, 40), max(n, 3)
    i = np.arange(along)[:, None]
    turn = lambda part, whole: 2 * math.pi * part / whole
    cp, sp = np.cos(turn(i * P % along, along)), np.sin(turn(i * P % along, along))
    cq, sq = np.cos(turn(i * Q % along, along)), np.sin(turn(i * Q % along, along))
    zero = np.zeros_like(cp)
    vector = lambda *axes: np.stack(axes, -1)
    normal = vector(cq * cp, sq, cq * sp)
    curve = vector(cp, zero, sp) * MAJOR + normal * MINOR
    tangent = vector(-sq * cp, cq, -sq * sp) * (MINOR * Q) + vector(-sp, zero, cp) * ((MAJOR + MINOR * cq) * P)[..., None]
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    binormal = np.cross(tangent, normal)
    j = np.arange(around)[None, :, None]
    outward = normal * np.cos(turn(j, around)) + binormal * np.sin(turn(j, around))
    positions = (curve + outward * TUBE).reshape(-1, 3).astype(np.float32).astype(np.float64)
    index = lambda a, b: a % along * around + b % around
    a, b = (grid.ravel() for grid in np.meshgrid(np.arange(along), np.arange(around), indexing="ij"))
    first = np.stack([index(a, b), index(a, b + 1), index(a + 1, b + 1)], -1)
    second = np.stack([index(a, b), index(a + 1, b + 1), index(a + 1, b)], -1)
    low, high = positions.min(0), positions.max(0)
    positions = (positions - (low + high) / 2) * (size / (high - low).max())
    # Both triangles of a cell come after each other.
    return positions, np.stack([first, second], 1).reshape(-1, 3)


class Reflection(mi.BSDF):
    """The formulas of src/world/brdf.rs. Half of the directions are drawn by the cosine, half by the highlight: paths that
    meet one highlight in another would be rare and bright otherwise."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        rgb = lambda name: mi.Color3f(*(props[f"{name}_{c}"] for c in "rgb"))
        self.albedo, self.specular = rgb("albedo"), rgb("specular")
        self.exponent, self.roughness = props.get("exponent", 0.0), props.get("roughness", 0.0)
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
        self.m_components = [flags]
        self.m_flags = flags

    def value(self, light, eye):
        diffuse = self.albedo * dr.inv_pi
        if self.exponent > 0:
            cosine = dr.dot(eye, mi.Vector3f(-light.x, -light.y, light.z))
            lobe = dr.select(cosine > 0, dr.power(dr.maximum(cosine, 0), self.exponent), 0)
            return diffuse + self.specular * ((self.exponent + 2) / (2 * math.pi) * lobe)
        half = dr.normalize(light + eye)
        across = dr.dot(half, eye)
        squared, m2 = half.z * half.z, self.roughness * self.roughness
        distribution = dr.exp((squared - 1) / (squared * m2)) / (math.pi * m2 * squared * squared)
        grooves = dr.minimum(1, 2 * half.z * dr.minimum(eye.z, light.z) / across)
        fresnel = self.specular + (1 - self.specular) * (1 - dr.minimum(across, 1)) ** 5
        return diffuse + fresnel * (distribution * grooves / (4 * light.z * eye.z))

    def density(self, light, eye):
        if self.exponent > 0:
            cosine = dr.dot(light, mi.Vector3f(-eye.x, -eye.y, eye.z))
            gloss = (self.exponent + 1) / (2 * math.pi) * dr.power(dr.maximum(cosine, 0), self.exponent)
        else:
            half = dr.normalize(light + eye)
            squared, m2 = half.z * half.z, self.roughness * self.roughness
            gloss = dr.exp((squared - 1) / (squared * m2)) / (math.pi * m2 * squared * half.z) / (4 * dr.dot(half, eye))
        return 0.5 * (mi.warp.square_to_cosine_hemisphere_pdf(light) + gloss)

    def sample(self, ctx, si, sample1, sample2, active):
        eye = si.wi
        sine, cosine = dr.sincos(2 * math.pi * sample2.y)
        if self.exponent > 0:
            z = dr.power(1 - sample2.x, 1 / (self.exponent + 1))
            across = dr.sqrt(dr.maximum(1 - z * z, 0))
            lobe = mi.Vector3f(across * cosine, across * sine, z)
            gloss = mi.Frame3f(mi.Vector3f(-eye.x, -eye.y, eye.z)).to_world(lobe)
        else:
            z = dr.rsqrt(1 - self.roughness * self.roughness * dr.log(1 - sample2.x))
            across = dr.sqrt(dr.maximum(1 - z * z, 0))
            half = mi.Vector3f(across * cosine, across * sine, z)
            gloss = 2 * dr.dot(eye, half) * half - eye
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = dr.select(sample1 < 0.5, gloss, mi.warp.square_to_cosine_hemisphere(sample2))
        bs.eta = 1.0
        bs.sampled_type = +mi.BSDFFlags.GlossyReflection
        bs.sampled_component = 0
        active &= (mi.Frame3f.cos_theta(eye) > 0) & (mi.Frame3f.cos_theta(bs.wo) > 0)
        bs.pdf = dr.select(active, self.density(bs.wo, eye), 0)
        active &= bs.pdf > 0
        weight = self.value(bs.wo, eye) * (mi.Frame3f.cos_theta(bs.wo) / bs.pdf)
        return bs, dr.select(active, weight, 0)

    def eval(self, ctx, si, wo, active):
        active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)
        return dr.select(active, self.value(wo, si.wi) * mi.Frame3f.cos_theta(wo), 0)

    def pdf(self, ctx, si, wo, active):
        active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)
        return dr.select(active, self.density(wo, si.wi), 0)

    def eval_pdf(self, ctx, si, wo, active):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def traverse(self, callback):
        pass

    def parameters_changed(self, keys=None):
        pass

    def to_string(self):
        return "Reflection[]"


mi.register_bsdf("bitlight", Reflection)


def rgb(value):
    return {"type": "rgb", "value": list(value)}


def spread(name, value):
    return {f"{name}_{c}": float(x) for c, x in zip("rgb", value)}


def harmonics(coefficients, width=512, height=256):
    """The sky of nine coefficients, RGB, as Mitsuba maps it: column u and row v stand for the direction
    (sin πv sin 2πu, cos πv, -sin πv cos 2πu); the first and the last row are the poles themselves."""
    v, u = np.meshgrid(np.arange(height) / (height - 1), (np.arange(width) + 0.5) / width, indexing="ij")
    theta, phi = math.pi * v, 2 * math.pi * u
    x, y, z = np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)
    c0, c1, c2 = math.sqrt(1 / (4 * math.pi)), math.sqrt(3 / (4 * math.pi)), math.sqrt(15 / (4 * math.pi))
    basis = [c0 + 0 * x, c1 * y, c1 * z, c1 * x, c2 * x * y, c2 * y * z, c2 / 12**0.5 * (3 * z * z - 1), c2 * x * z]
    basis = np.stack([*basis, c2 / 2 * (x * x - y * y)], -1)
    radiance = basis @ np.array(coefficients)
    assert radiance.min() > 0
    return radiance.astype(np.float32)


SKY = {"kind": "constant", "radiance": [1, 1, 1]}
SUN = {"kind": "directional", "direction": [0.4, -0.8, -0.45], "irradiance": [3, 2.5, 2]}
LAMP = {"kind": "point", "position": [-30, 45, 60], "intensity": [16000, 15000, 13000]}
SMOOTH = {
    "kind": "harmonics",
    "coefficients": [
        [3.5, 3.5, 3.8],
        [1.2, 0.6, 0.8],
        [0, -0.8, 0.3],
        [0.4, 0, -1],
        [0, 0.3, 0],
        [0.2, 0, 0],
        [0, 0, 0.25],
        [0, 0.2, 0],
        [0, 0, -0.4],
    ],
}
DIFFUSE = {"albedo": [0.8, 0.5, 0.3]}
PHONG = {"albedo": [0.3, 0.2, 0.1], "specular": [0.4, 0.5, 0.6], "exponent": 30}
COOK = {"albedo": [0.3, 0.2, 0.1], "specular": [0.6, 0.4, 0.2], "roughness": 0.3}
ISOTROPIC = {"scattering": [0.3, 0.4, 0.5], "absorption": [0.01, 0.02, 0.04], "g": 0, "eta": 1.3}
FORWARD = {"scattering": [0.6, 0.8, 1.0], "absorption": [0.01, 0.02, 0.04], "g": 0.5, "eta": 1.5}
SCENES = {
    "diffuse-sky": {"surface": DIFFUSE, "lights": [SKY, SUN]},
    "diffuse-lamp": {"surface": DIFFUSE, "lights": [LAMP]},
    "phong-sky": {"surface": PHONG, "lights": [SMOOTH]},
    "phong-sun": {"surface": PHONG, "lights": [SUN]},
    "cook-torrance-sky": {"surface": COOK, "lights": [SMOOTH]},
    "cook-torrance-lamp": {"surface": COOK, "lights": [LAMP]},
    "translucent-constant": {"volume": ISOTROPIC, "lights": [SKY]},
    "translucent-sky": {"volume": ISOTROPIC, "lights": [SMOOTH]},
    "translucent-forward": {"volume": FORWARD, "lights": [SMOOTH]},
}
# The knot's divisions and longest side, the camera, and the image's and the blocks' sides in pixels.
FRAME = {
    "resolution": 12,
    "size": 50,
    "camera": {"position": [0, 16, 84], "target": [0, 0, 0], "up": [0, 1, 0], "fov": 36},
    "side": 64,
    "block": 4,
}


def emitter(light):
    if light["kind"] == "point":
        return {"type": "point", "position": light["position"], "intensity": rgb(light["intensity"])}
    if light["kind"] == "directional":
        return {"type": "directional", "direction": light["direction"], "irradiance": rgb(light["irradiance"])}
    if light["kind"] == "constant":
        return {"type": "constant", "radiance": rgb(light["radiance"])}
    return {"type": "envmap", "bitmap": mi.Bitmap(harmonics(light["coefficients"]))}


def write_ply(path, positions, triangles):
    """Triangles with corners in f32, as bitlight has them."""
    faces = np.zeros(len(triangles), [("count", "u1"), ("corners", "<u4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(positions)}"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"element face {len(triangles)}", "property list uchar uint vertex_indices", "end_header\n"]
    path.write_bytes("\n".join(lines).encode() + positions.astype("<f4").tobytes() + faces.tobytes())


def load(scene, folder):
    file = folder / "knot.ply"
    positions, triangles = knot(FRAME["resolution"], FRAME["size"])
    write_ply(file, positions, triangles)
    shape = {"type": "ply", "filename": str(file), "face_normals": True}
    if "volume" in scene:
        volume = scene["volume"]
        scattering, absorption = (np.array(volume[key]) for key in ("scattering", "absorption"))
        shape["bsdf"] = {"type": "dielectric", "int_ior": float(volume["eta"]), "ext_ior": 1.0}
        shape["interior"] = {
            "type": "homogeneous",
            "albedo": {"type": "constvolume", "value": rgb(scattering / (scattering + absorption))},
            "sigma_t": {"type": "constvolume", "value": rgb(scattering + absorption)},
            "phase": {"type": "hg", "g": float(volume["g"])},
        }
    elif "specular" in scene["surface"]:
        surface = scene["surface"]
        shape["bsdf"] = {"type": "bitlight"} | spread("albedo", surface["albedo"])
        shape["bsdf"] |= spread("specular", surface["specular"])
        shape["bsdf"] |= {key: float(surface[key]) for key in ("exponent", "roughness") if key in surface}
    else:
        shape["bsdf"] = {"type": "diffuse", "reflectance": rgb(scene["surface"]["albedo"])}
    camera, side = FRAME["camera"], FRAME["side"]
    whole = {
        "type": "scene",
        # Pixels that see no surface are black. volpath would draw free paths of one channel for all three and have rare
        # samples of great weight; volpathmis weighs the channels against each other.
        "integrator": {"type": "volpathmis" if "volume" in scene else "path", "max_depth": -1, "hide_emitters": True},
        "sensor": {
            "type": "perspective",
            "fov": float(camera["fov"]),
            "fov_axis": "y",
            "near_clip": 1.0,
            "far_clip": 1e4,
            "to_world": mi.ScalarTransform4f().look_at(camera["position"], camera["target"], camera["up"]),
            "film": {
                "type": "hdrfilm",
                "width": side,
                "height": side,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": "independent"},
        },
        "shape": shape,
    }
    return mi.load_dict(whole | {f"light{n}": emitter(light) for n, light in enumerate(scene["lights"])})


def table(name, loaded, passes, spp, folder):
    images = [np.array(mi.render(loaded, spp=spp, seed=seed), dtype=np.float64) for seed in range(passes)]
    images = np.stack(images)
    np.stack([images.mean(0), images.var(0, ddof=1) / passes]).tofile(folder / name)
    side, block = FRAME["side"], FRAME["block"]
    count = side // block
    blocks = images.reshape(passes, count, block, count, block, 3).mean((2, 4)).reshape(passes, -1, 3)
    mean, error = blocks.mean(0), blocks.std(0, ddof=1) / math.sqrt(passes)
    # Blocks whose every channel is known to 1 %: in others, on the solid's edge or deep in shadow, few samples find light.
    seen = [index for index in range(len(mean)) if (error[index] < 0.01 * mean[index]).all()]
    rows = [[index, *(float(f"{x:.5g}") for x in mean[index]), *(float(f"{x:.2g}") for x in error[index])] for index in seen]
    about = {"scene": name, "peer": f"Mitsuba {mi.__version__}", "passes": passes, "spp": spp, **FRAME, **SCENES[name]}
    lines = ",\n".join(f'  "{key}": {json.dumps(value)}' for key, value in about.items())
    lines += ',\n  "rows": [\n' + ",\n".join(f"    {json.dumps(row)}" for row in rows) + "\n  ]"
    (HERE / f"{name}.json").write_text("{\n" + lines + "\n}\n")


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    print(f"Mitsuba {mi.__version__}, {mi.variant()}", flush=True)
    scenes = {}
    for line in sys.stdin:
        what, name, *numbers = line.split()
        if name not in scenes:
            scenes[name] = load(SCENES[name], folder)
        first, second = map(int, numbers)
        if what == "table":
            table(name, scenes[name], first, second, folder)
        else:
            dr.eval(mi.render(scenes[name], spp=first, seed=second))
            dr.sync_thread()
        print("done", flush=True)


if __name__ == "__main__":
    main()
