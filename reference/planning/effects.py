"""The effects of light: one enumeration, for planning, cost and reports."""

from dataclasses import dataclass
from enum import Enum


class Effect(Enum):
    """An effect: its name, what it is in the heuristic and in the reference, and what it costs."""

    EMISSION = ("emission", "k_i (8.1)", "area emitters, seen", "an addition")
    AMBIENT = ("ambient", "I_a k_a (8.2)", "see environment", "an addition")
    DIFFUSE = ("diffuse", "k_d (N.L) (8.5)", "diffuse, or roughplastic's base", "a scalar product")
    SPECULAR = ("specular", "k_s (R.V)^n (8.9)", "roughplastic's coat", "a vector and a power")
    ATTENUATION = ("distance attenuation", "f_att (6.1, 8.6)", "1 / d^2", "a division a light")
    CONE = ("spot cone", "6.2-6.4", "spot", "a comparison and a power a light")
    POLYGONS = ("polygon interpolation", "flat, Gouraud (6.35-6.38)", "none", "less than Phong")
    OCCLUSION = ("occlusion", "none, or where asked for", "shadow rays", "a ray a light")
    MICROFACETS = ("microfacets and Fresnel", "none", "roughplastic", "a BSDF evaluation a light")
    EXTENDED = (
        "extended lights",
        "a spot or point",
        "sampled area lights",
        "samples, two rays each",
    )
    ENVIRONMENT = ("environment", "ambient light", "light from everywhere", "samples, or a table")
    INTERREFLECTION = ("interreflection", "none", "paths", "samples, two rays a reflection")
    TRANSMISSION = ("transmission", "none", "refraction and media", "samples, rays a surface")
    SPECTRAL = (
        "spectral",
        "as many values as given (8.11)",
        "wavelengths",
        "samples, 4 values each",
    )

    def __init__(self, label, heuristic, reference, cost):
        self.label = label
        self.heuristic = heuristic
        self.reference = reference
        self.cost = cost


@dataclass(frozen=True)
class Decision:
    """Whether an effect is called for, and the rule and evidence that decided.

    ``rule`` says of what kind the reason is: ``structural`` for a proof from what the scene is made
    of, ``simulated`` where no proof was found, ``asked`` where pruning is switched off.
    """

    effect: Effect
    called_for: bool
    rule: str
    evidence: str
