"""Shaders with one usual bug each, and right shaders of many models.

A bug replaces one piece of a right shader. Bugs and models were collected before what names them
was written.
"""

from dataclasses import dataclass
from pathlib import Path

HEAD = """
from fotismos import Range
import drjit as dr

PI = 3.14159265358979


def power(base, exponent):
    return dr.select(base > 0, dr.maximum(base, 1e-6) ** exponent, 0)


def f0_of(m):
    return dr.lerp(dr.square((m.ior - 1) / (m.ior + 1)), m.base_color, m.metallic)

"""

PHONG = """
def shade(point):
    m = point.material
    N = point.normal
    V = point.view
    value = m.k_i + point.ambient * m.k_a
    for light in point.lights:
        L = light.toward
        NL = dr.dot(N, L)
        R = 2 * NL * N - L
        lobe = power(dr.dot(R, V), m.n)
        diffuse = m.k_d * dr.maximum(NL, 0)
        specular = dr.select(NL > 0, m.k_s * lobe, 0)
        value += light.intensity * diffuse + light.intensity * specular
    return value
"""

BLINN = PHONG.replace("R = 2 * NL * N - L", "H = dr.normalize(L + V)").replace(
    "dr.dot(R, V), m.n", "dr.dot(N, H), 4 * m.n"
)

GGX = """
def shade(point):
    m = point.material
    N = point.normal
    V = point.view
    NV = dr.maximum(dr.dot(N, V), 1e-4)
    F0 = f0_of(m)
    value = point.ambient * m.base_color * (1 - m.metallic)
    for light in point.lights:
        L = light.toward
        H = dr.normalize(L + V)
        NL = dr.maximum(dr.dot(N, L), 0)
        NH = dr.maximum(dr.dot(N, H), 0)
        VH = dr.maximum(dr.dot(V, H), 0)
        a2 = m.alpha * m.alpha
        D = a2 / (PI * dr.square(NH * NH * (a2 - 1) + 1))
        k = m.alpha / 2
        G = NL / (NL * (1 - k) + k) * (NV / (NV * (1 - k) + k))
        F = F0 + (1 - F0) * (1 - VH) ** 5
        specular = D * G * F / (4 * dr.maximum(NL, 1e-4) * NV)
        diffuse = (1 - F) * (1 - m.metallic) * m.base_color / PI
        value += PI * light.intensity * NL * (diffuse + specular)
    return value
"""


@dataclass(frozen=True)
class Bug:
    """A right shader's piece, and what replaces it; ``names`` is what a finding must hold.

    In Blinn's model, where it differs, it must hold ``blinn``.
    """

    name: str
    base: str
    piece: str
    wrong: str
    names: str
    blinn: str = ""

    @property
    def in_blinn(self) -> str:
        """What a finding must hold in Blinn's model."""
        return self.blinn or self.names

    def write(self, folder: Path) -> Path:
        """Write the shader to a folder, and return its path."""
        assert self.piece in self.base, self.name
        path = folder / "shader.py"
        path.write_text(HEAD + self.base.replace(self.piece, self.wrong), encoding="utf-8")
        return path


END = "    return value"
SUM = "light.intensity * diffuse + light.intensity * specular"
MIRROR = "R = 2 * NL * N - L"
HALF = "H = dr.normalize(L + V)"
TOWARD = "L = light.toward"
VIEW = "V = point.view"

BUGS = (
    # Vectors
    Bug("mirror: bracket around N - L", PHONG, MIRROR, "R = 2 * NL * (N - L)",
        r"bracket is misplaced, 2 \(N.L\) \(N - L\)"),
    Bug("mirror: factor 2 missing", PHONG, MIRROR, "R = NL * N - L",
        "lacks the factor 2"),
    Bug("mirror: cosine missing", PHONG, MIRROR, "R = 2 * N - L",
        "lacks the cosine, 2 N - L"),
    Bug("mirror: reversed", PHONG, MIRROR, "R = L - 2 * NL * N",
        "mirrored vector is reversed"),
    Bug("mirror: of the viewer's cosine", PHONG, MIRROR, "R = 2 * dr.dot(N, V) * N - L",
        "has the viewer's cosine"),
    Bug("view reversed", PHONG, VIEW, "V = -point.view",
        "view vector is reversed"),
    Bug("view is the position reversed", PHONG, VIEW, "V = dr.normalize(-point.position)",
        "view vector is the position reversed"),
    Bug("light reversed", PHONG, TOWARD, "L = -light.toward",
        "light vector is reversed"),
    Bug("light not normalised", PHONG, TOWARD, "L = light.toward * light.distance",
        "`toward` is a unit vector"),
    Bug("light of length 0.8", PHONG, TOWARD, "L = 0.8 * light.toward",
        "light vector is not normalised: .* 0.8"),
    Bug("normal of length 1.3", PHONG, "N = point.normal", "N = 1.3 * point.normal",
        "normal is not normalised: .* 1.3", "Normalise every vector"),
    Bug("normal encoded", PHONG, "N = point.normal", "N = point.normal * 0.5 + 0.5",
        "normal is encoded", "Normalise every vector"),
    Bug("normal in another space", PHONG, "N = point.normal",
        "N = type(point.normal)(point.normal.x, point.normal.z, -point.normal.y)",
        r"looks like \(x, z, -y\)"),
    Bug("half: (L + V) / 2", BLINN, HALF, "H = 0.5 * (L + V)",
        r"half vector is not normalised, \(L"),
    Bug("half: L + V, cosine cut at 1", BLINN, "dr.dot(N, H)", "dr.minimum(dr.dot(N, L + V), 1)",
        "not normalised, L .* cut at 1"),
    Bug("half: L - V", BLINN, HALF, "H = dr.normalize(L - V)",
        "half vector is of the reversed view"),
    Bug("half: of normal and viewer", BLINN, "dr.dot(N, H)", "dr.dot(L, dr.normalize(N + V))",
        "half vector is that of normal and viewer"),
    Bug("half: in GGX not normalised", GGX, HALF, "H = 0.5 * (L + V)",
        r"half vector is not normalised, \(L"),
    # Cosines
    Bug("diffuse: cosine squared", PHONG, "dr.maximum(NL, 0)", "dr.square(dr.maximum(NL, 0))",
        "squared cosine"),
    Bug("diffuse: cosine missing", PHONG, "m.k_d * dr.maximum(NL, 0)",
        "dr.select(NL > 0, m.k_d, 0)",
        "missing cosine"),
    Bug("diffuse: the viewer's cosine", PHONG, "dr.maximum(NL, 0)",
        "dr.select(NL > 0, dr.maximum(dr.dot(N, V), 0), 0)",
        "diffuse light has the cosine of the viewer"),
    Bug("diffuse: the half vector's cosine", BLINN, "dr.maximum(NL, 0)",
        "dr.select(NL > 0, dr.maximum(dr.dot(N, H), 0), 0)",
        "diffuse light has the cosine of the half vector"),
    Bug("diffuse: light against viewer", PHONG, "dr.maximum(NL, 0)", "dr.maximum(dr.dot(L, V), 0)",
        "diffuse light has the cosine of light and viewer"),
    Bug("cosine without its sign", PHONG, "NL = dr.dot(N, L)", "NL = dr.abs(dr.dot(N, L))",
        "lost its sign"),
    Bug("highlight from below", PHONG, "dr.select(NL > 0, m.k_s * lobe, 0)", "m.k_s * lobe",
        "shown for light from below"),
    # Fall-off
    Bug("fall-off missing", PHONG, END,
        "    return value * dr.square(point.lights[0].distance)",
        "fall-off .* is missing"),
    Bug("fall-off twice", PHONG, "light.intensity * diffuse + light.intensity * specular",
        "light.intensity * (diffuse + specular) / dr.square(light.distance)",
        "a second time"),
    Bug("fall-off with the distance alone", PHONG, SUM,
        "light.intensity * (diffuse + specular) * light.distance",
        "Do not multiply by the distance"),
    Bug("fall-off with the distance once more", PHONG, SUM,
        "light.intensity * (diffuse + specular) / light.distance",
        "with the distance once more"),
    Bug("fall-off in centimetres", PHONG, SUM, "light.intensity * (diffuse + specular) / 10000",
        "another unit of length"),
    # Highlight
    Bug("Blinn's lobe with Phong's exponent", PHONG, "dr.dot(R, V)",
        "dr.dot(N, dr.normalize(L + V))",
        "about the half vector, with the exponent"),
    Bug("exponent times 4", PHONG, "m.n)", "4 * m.n)",
        "exponent is 4 times"),
    Bug("exponent over 4", PHONG, "m.n)", "m.n / 4)",
        "exponent is 0.25 times", "too wide; about 4 times"),
    Bug("exponent 0", PHONG, "m.n)", "0)",
        "exponent is 0, so"),
    Bug("lobe of the light's cosine", PHONG, "dr.dot(R, V)", "NL",
        "lobe's cosine is that of diffuse light"),
    Bug("lobe of the half vector and the viewer", BLINN, "dr.dot(N, H)", "dr.dot(V, H)",
        "lobe's cosine is V.H"),
    Bug("highlight times the cosine", PHONG, "m.k_s * lobe", "m.k_s * lobe * NL",
        "lobe is multiplied by N.L"),
    Bug("highlight without the light's colour", PHONG, "light.intensity * specular",
        "dr.mean(light.intensity) * specular",
        "lack the light's colour"),
    Bug("highlight without the light", PHONG, "light.intensity * specular", "specular",
        "lack the light's intensity"),
    Bug("highlight of the diffuse colour", PHONG, "m.k_s * lobe", "m.k_d * lobe",
        "colour k_d in place"),
    Bug("highlight of both colours", PHONG, "m.k_s * lobe", "m.k_d * m.k_s * lobe",
        "k_d and k_s, multiplied"),
    Bug("highlight normalised by n + 2", PHONG, "m.k_s * lobe", "m.k_s * (m.n + 2) / 2 * lobe",
        r"normalised by n \+ 2", r"normalised by n \+ 8"),
    # Ambient light, emission
    Bug("ambient light for each light", PHONG, "value += ",
        "value += point.ambient * m.k_a + ",
        "once for each light"),
    Bug("ambient light times the light", PHONG, "value += ",
        "value += point.ambient * m.k_a * (light.intensity - 1 / len(point.lights)) + ",
        "multiplied by the lights' intensity"),
    Bug("ambient light missing", PHONG, "m.k_i + point.ambient * m.k_a", "m.k_i",
        "ambient light is missing"),
    Bug("ambient light of no colour", PHONG, "point.ambient * m.k_a", "point.ambient",
        "lacks the colour k_a"),
    # Microfacets
    Bug("D: square of the denominator missing", GGX, "dr.square(NH * NH * (a2 - 1) + 1)",
        "(NH * NH * (a2 - 1) + 1)",
        "square of D's denominator"),
    Bug("D: denominator missing", GGX, "a2 / (PI * dr.square(NH * NH * (a2 - 1) + 1))", "a2 / PI",
        "D's denominator is missing"),
    Bug("D: NH not squared", GGX, "NH * NH * (a2 - 1)", "NH * (a2 - 1)",
        "D has N.H in place"),
    Bug("D: pi missing", GGX, "a2 / (PI * dr", "a2 / (dr",
        "3.14 times .* division by pi"),
    Bug("alpha in place of its square", GGX, "a2 = m.alpha * m.alpha", "a2 = m.alpha",
        r"alpha stands where alpha\^2"),
    Bug("alpha squared again", GGX, "a2 = m.alpha * m.alpha", "a2 = dr.square(m.alpha * m.alpha)",
        "alpha is squared once more"),
    Bug("G: of the light alone", GGX, " * (NV / (NV * (1 - k) + k))", "",
        "that of the light alone"),
    Bug("G: of the viewer alone", GGX, "NL / (NL * (1 - k) + k) * ", "",
        "that of the viewer alone"),
    Bug("G: missing", GGX, "NL / (NL * (1 - k) + k) * (NV / (NV * (1 - k) + k))", "1",
        "G is missing"),
    Bug("F: of N.V", GGX, "(1 - VH) ** 5", "dr.maximum(1 - NV, 0) ** 5",
        "F is of N.V"),
    Bug("F: of N.L", GGX, "(1 - VH) ** 5", "dr.maximum(1 - NL, 0) ** 5",
        "F is of N.L"),
    Bug("F: of N.H", GGX, "(1 - VH) ** 5", "dr.maximum(1 - NH, 0) ** 5",
        "F is of N.H"),
    Bug("F: missing", GGX, "D * G * F", "D * G",
        "F is missing"),
    Bug("F0 of metals is that of glass", GGX, "F0 = f0_of(m)",
        "F0 = dr.square((m.ior - 1) / (m.ior + 1))",
        "F0 of metals"),
    Bug("the 4 missing", GGX, "(4 * dr.maximum(NL, 1e-4) * NV)", "(dr.maximum(NL, 1e-4) * NV)",
        "the 4 of the divisor"),
    Bug("the denominator missing", GGX, " / (4 * dr.maximum(NL, 1e-4) * NV)", "",
        "divisor .* is missing"),
    Bug("N.V missing in the denominator", GGX, "(4 * dr.maximum(NL, 1e-4) * NV)",
        "(4 * dr.maximum(NL, 1e-4))",
        "N.V is missing"),
    Bug("N.L missing", GGX, "light.intensity * NL * (diffuse", "light.intensity * (diffuse",
        "missing cosine: multiply it by N.L"),
    Bug("metals have a diffuse base", GGX, "(1 - F) * (1 - m.metallic)", "(1 - F)",
        "metals have a diffuse base"),
    Bug("diffuse light not over pi", GGX, "m.base_color / PI", "m.base_color",
        "diffuse light is 3.14"),
    # Transfer, channels, sums, pi
    Bug("colours decoded again", PHONG, "m.k_d * dr", "m.k_d ** 2.2 * dr",
        "colours of diffuse light are decoded by a power of 2.2"),
    Bug("encoded by 1/2.2", PHONG, END, "    return dr.maximum(value, 0) ** (1 / 2.2)",
        "encoded by a power"),
    Bug("decoded by 2.2", PHONG, END, "    return dr.maximum(value, 0) ** 2.2",
        "decoded by a power"),
    Bug("cut at 1", PHONG, END, "    return dr.minimum(value, 1)",
        "end at 1"),
    Bug("channels reversed", PHONG, END,
        "    return type(value)(value.z, value.y, value.x)",
        "blue, green, red"),
    Bug("the last light alone", PHONG, "value += ", "value = m.k_i + point.ambient * m.k_a + ",
        "only the last light"),
    Bug("all over pi", PHONG, SUM, "light.intensity * (diffuse + specular) / PI",
        "0.318 .* division by pi too many"),
    Bug("all times pi", PHONG, SUM, "PI * light.intensity * (diffuse + specular)",
        "3.14 .* missing division"),
    Bug("diffuse over pi", PHONG, "m.k_d * dr", "m.k_d / PI * dr",
        "diffuse light is 0.318"),
)  # fmt: skip
"""Each of them is a mistake that people made, in courses, forums and trackers of engines."""


def lit(value: str, prelude: str = "") -> str:
    """Return a shader that adds ``value`` times the intensity for each light."""
    return f"""
def shade(point):
    m = point.material
    N = point.normal
    V = point.view
    NV = dr.maximum(dr.dot(N, V), 1e-4)
    value = point.ambient * m.base_color
    for light in point.lights:
        L = light.toward
        NL = dr.maximum(dr.dot(N, L), 0)
        H = dr.normalize(L + V)
        NH = dr.maximum(dr.dot(N, H), 0)
        VH = dr.maximum(dr.dot(V, H), 0)
        {prelude or "pass"}
        value += light.intensity * ({value})
    return value
"""


SMITH = GGX.replace(
    "G = NL / (NL * (1 - k) + k) * (NV / (NV * (1 - k) + k))",
    "G = 2 * NL / (NL + dr.sqrt(a2 + (1 - a2) * NL * NL))"
    " * (2 * NV / (NV + dr.sqrt(a2 + (1 - a2) * NV * NV)))",
)
CORRELATED = GGX.replace(
    "G = NL / (NL * (1 - k) + k) * (NV / (NV * (1 - k) + k))",
    "G = 2 * NL * NV / (NV * dr.sqrt(a2 + (1 - a2) * NL * NL)"
    " + NL * dr.sqrt(a2 + (1 - a2) * NV * NV) + 1e-7)",
)
BECKMANN = GGX.replace(
    "D = a2 / (PI * dr.square(NH * NH * (a2 - 1) + 1))",
    "D = dr.exp((NH * NH - 1) / (a2 * dr.maximum(NH * NH, 1e-4)))"
    " / (PI * a2 * dr.maximum(NH, 1e-3) ** 4)",
).replace(
    "G = NL / (NL * (1 - k) + k) * (NV / (NV * (1 - k) + k))",
    "G = dr.minimum(1, 2 * NH / dr.maximum(VH, 1e-4) * dr.minimum(NL, NV))",
)

RIGHT = {
    "phong": PHONG,
    "blinn": BLINN,
    "lambert": lit("m.base_color * NL"),
    "half lambert": lit("m.base_color * dr.square(0.5 * dr.dot(N, L) + 0.5)"),
    "wrapped": lit("m.base_color * dr.maximum(dr.dot(N, L) + 0.4, 0) / 1.4"),
    "toon": lit("m.base_color * dr.ceil(3 * NL) / 3"),
    "oren nayar": lit(
        "m.base_color * NL * (0.7 + 0.3 * dr.maximum(dr.dot(L, V) - NL * NV, 0)"
        " / dr.maximum(dr.maximum(NL, NV), 1e-3))"
    ),
    "burley diffuse": lit(
        "m.base_color * NL * (1 + (2 * m.alpha * VH * VH - 0.5) * (1 - NL) ** 5)"
        " * (1 + (2 * m.alpha * VH * VH - 0.5) * dr.maximum(1 - NV, 0) ** 5)"
    ),
    "minnaert": lit("m.base_color * NL * dr.maximum(NL * NV, 1e-4) ** 0.3"),
    "lommel seeliger": lit("m.base_color * NL / (NL + NV)"),
    "ggx": GGX,
    "ggx, smith": SMITH,
    "ggx, correlated": CORRELATED,
    "ggx, constant f0": GGX.replace("f0_of(m)", "dr.lerp(0.04, m.base_color, m.metallic)"),
    "ggx, no coupling": GGX.replace("(1 - F) * (1 - m.metallic)", "(1 - m.metallic)"),
    "beckmann, cook torrance": BECKMANN,
    "ward": lit(
        "m.base_color * NL + dr.select(NL > 0, m.k_s * dr.exp((1 - 1 / dr.maximum(NH * NH, 1e-3))"
        " / dr.square(m.alpha)) / (4 * dr.square(m.alpha)) * dr.sqrt(NL / NV), 0)"
    ),
    "schlick's lobe": lit(
        "m.k_d * NL + dr.select(NL > 0, m.k_s * t / (m.n - m.n * t + t), 0)",
        "t = dr.maximum(dr.dot(2 * NL * N - L, V), 0)",
    ),
    "sheen": lit(
        "m.base_color * NL + 0.1 * NL * dr.maximum(1 - NH * NH, 1e-4) ** (0.5 / m.alpha)"
        " * (2 + 1 / m.alpha) / (NL + NV - NL * NV)"
    ),
    "rim": lit("m.base_color * NL + 0.3 * NL * dr.maximum(1 - NV, 0) ** 3"),
    "modified phong": lit(
        "m.k_d * NL + dr.select(NL > 0, m.k_s * NL * (m.n + 2) / 2 * power(dr.dot(2 * NL * N - L,"
        " V), m.n), 0)"
    ),
    "gooch": lit("m.base_color * (0.3 + 0.35 * (1 + dr.dot(N, L))) * 0.8"),
}
"""Shaders without a bug."""


def write_right(name: str, folder: Path) -> Path:
    """Write a right shader to a folder, and return its path."""
    path = folder / "shader.py"
    path.write_text(HEAD + RIGHT[name], encoding="utf-8")
    return path
