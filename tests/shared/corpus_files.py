"""The files that the scenes of `tests/corpus` refer to, made from formulas."""

import struct
import zlib

import mitsuba as mi
import numpy as np

TETRAHEDRON = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]], np.float32) * 0.8
FACES = np.array([[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]], np.uint32)


def write(folder):
    """Write all files to a folder."""
    _images(folder)
    _meshes(folder)
    _volumes(folder)
    (folder / "curve.txt").write_text(
        "\n".join(f"{0.3 * i - 1} {0.2 * (i % 3)} {0.1 * i} 0.15" for i in range(8))
    )
    _measured(folder / "measured.bsdf")


def _images(folder):
    x, y = np.meshgrid(np.linspace(0, 1, 16), np.linspace(0, 1, 8))
    waves = 0.5 + 0.4 * np.sin(2 * np.pi * x) * np.cos(2 * np.pi * y)
    _png(folder / "waves.png", np.stack([waves, waves, 1 - waves], axis=2))
    slope = 0.3 * np.sin(2 * np.pi * x)
    normal = np.stack([slope, 0 * x, np.sqrt(1 - slope**2)], axis=2)
    _png(folder / "normals.png", (normal + 1) / 2)
    sky = np.stack([0.5 * (1 - y), 0.6 * (1 - y), 1 - y], axis=2).astype(np.float32)
    mi.Bitmap(sky).write(str(folder / "sky.exr"))
    mi.Bitmap(20 * sky).write(str(folder / "glow.exr"))


def _png(path, values):
    mi.Bitmap((255 * values).astype(np.uint8)).write(str(path))


def _meshes(folder):
    lines = [f"v {x} {y} {z}" for x, y, z in TETRAHEDRON]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES]
    (folder / "tetrahedron.obj").write_text("\n".join(lines) + "\n")
    mesh = mi.Mesh("coloured", 4, 4)
    params = mi.traverse(mesh)
    params["vertex_positions"], params["faces"] = TETRAHEDRON.ravel(), FACES.ravel()
    params.update()
    mesh.add_attribute("vertex_color", 3, np.tile([0.8, 0.4, 0.2, 0.1, 0.4, 0.8], 2))
    mesh.write_ply(str(folder / "coloured.ply"))
    (folder / "tetrahedron.serialized").write_bytes(_serialized())
    _ellipsoids(folder / "ellipsoids.ply")


def _serialized():
    """One mesh in the format of Mitsuba's ``serialized``, version 4, single precision."""
    body = struct.pack("<I", 0x1000) + b"tetrahedron\0" + struct.pack("<QQ", 4, 4)
    body += TETRAHEDRON.tobytes() + FACES.tobytes()
    return struct.pack("<HH", 0x041C, 4) + zlib.compress(body) + struct.pack("<QI", 0, 1)


def _ellipsoids(path):
    names = [*"xyz", "nx", "ny", "nz", *(f"scale_{i}" for i in range(3))]
    names += [f"rot_{i}" for i in range(4)]
    rows = np.zeros((2, len(names)), "<f4")
    rows[:, 0], rows[:, 6:9], rows[:, 9] = (-0.5, 0.5), -1.5, 1
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    head += [f"property float {name}" for name in names] + ["end_header"]
    path.write_bytes("\n".join(head).encode() + b"\n" + rows.tobytes())


def _volumes(folder):
    cells = (np.arange(8) + 0.5) / 8 - 0.5
    z, y, x = np.meshgrid(cells, cells, cells, indexing="ij")
    distance = np.sqrt(x**2 + y**2 + z**2)
    _vol(folder / "ball.vol", distance - 0.3)
    _vol(folder / "cloud.vol", 2 * np.exp(-8 * distance**2))
    flakes = np.zeros((2, 2, 2, 6))
    flakes[..., :3] = 0.3, 0.3, 1.0
    _vol(folder / "flakes.vol", flakes)


def _vol(path, values):
    values = np.asarray(values, np.float32)
    mi.VolumeGrid(values[..., None] if values.ndim == 3 else values).write(str(path))


def _measured(path):
    """Write a measured material with every table even: a grey one, of no particular surface."""
    grid = (1, 2, 4, 4)
    fields = {
        "description": np.frombuffer(b"grey", np.uint8),
        "phi_i": np.zeros(1, "<f4"),
        "theta_i": np.array([0, np.pi / 2], "<f4"),
        "ndf": np.ones((4, 4), "<f4"),
        "sigma": np.ones((4, 4), "<f4"),
        "vndf": np.ones(grid, "<f4"),
        "luminance": np.ones(grid, "<f4"),
        "rgb": np.full((1, 2, 3, 4, 4), 0.3, "<f4"),
        "jacobian": np.ones(1, np.uint8),
    }
    kinds = {"uint8": 1, "float32": 10}
    size = 18 + sum(2 + len(n) + 2 + 1 + 8 + 8 * a.ndim for n, a in fields.items())
    head, body = b"tensor_file\0" + struct.pack("<BBI", 1, 0, len(fields)), b""
    for name, array in fields.items():
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ", array.ndim, kinds[str(array.dtype)], size + len(body))
        head += struct.pack(f"<{array.ndim}Q", *array.shape)
        body += array.tobytes()
    path.write_bytes(head + body)
