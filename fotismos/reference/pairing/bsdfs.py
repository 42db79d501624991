"""Replacing the BSDFs of a scene by their counterparts, by the conventions of pairing.

Towards the textbook half there is one rule per plugin, which returns the nearest ``phong``:
:mod:`fotismos.reference.pairing.nearest`. Those of the plainest materials are here. Values are
those of :mod:`fotismos.reference.scene.values`.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from math import inf
from typing import Any

import mitsuba as mi

from fotismos.heuristic.materials import COEFFICIENTS, SMALLEST_ALPHA
from fotismos.reference.pairing.factors import Convention, Phong, Replacements
from fotismos.reference.pairing.pairing_record import Miss
from fotismos.reference.scene import values
from fotismos.reference.scene.graph import Graph, properties

BSDF = mi.ObjectType.BSDF
TEXTURE = mi.ObjectType.Texture

REFLECTANCES: dict[str, dict[str, float]] = {
    "phong": {"k_d": 0.0, "k_s": 0.0},
    "diffuse": {"reflectance": 0.5},
    "roughplastic": {"diffuse_reflectance": 0.5, "specular_reflectance": 1.0},
    "plastic": {"diffuse_reflectance": 0.5, "specular_reflectance": 1.0},
    "conductor": {"specular_reflectance": 1.0},
    "roughconductor": {"specular_reflectance": 1.0},
    "principled": {},
}
"""Plugins that only reflect, on the side of the normal. If all of a plugin's parameters here are 0,
it reflects nothing; values are defaults. A plugin without parameters may always reflect."""

TRANSMITTANCES = {"principled": {"spec_trans": 0.0}}
"""Parameters with which one of these transmits, unless they are 0."""

BUMPS = ("normalmap", "bumpmap")
WRAPPERS = ("twosided", "mask", "blendbsdf", *BUMPS)
"""Plugins that are made of other BSDFs."""

BUMP_SHADOWS = ("shadows that bumps cast on themselves", "none")
LAYERED_BUMPS = (
    ("nested normal maps", "only the outer one"),
    ("the normals of the back", "those of the front"),
    ("two normals at a point", "that of the first map"),
)
"""What is lost of bumps, and what replaces it: maps in maps, in `twosided`, in `blendbsdf`."""

COLOURS = {
    "diffuse": ("reflectance",),
    "roughplastic": ("diffuse_reflectance", "specular_reflectance"),
    "principled": ("base_color",),
    "phong": ("k_i", "k_a", "k_d", "k_s"),
}
"""Colours that pairing reads; they are checked before."""

UNSEEN = ("mirror image", "nothing: the kernel traces no rays")
"""What is lost of a ``phong`` with an infinite ``n`` (8.7), and what replaces it."""

PLASTICS = (1.3, 1.8)
"""Indices of refraction of real plastics: fluoropolymers have 1.3, those rich in sulphur 1.76."""


def has_bump_shadows(props: mi.Properties) -> bool:
    """Return whether a BSDF is a map whose bumps cast shadows on themselves, as is usual."""
    return props.plugin_name() in BUMPS and bool(props.get("use_shadowing_function", True))


def give_default(graph: Graph) -> None:
    """Give shapes without a BSDF Mitsuba's default, so it can be paired."""
    for shape in graph.nodes(mi.ObjectType.Shape):
        if not graph.children(shape, BSDF) and not graph.children(shape, mi.ObjectType.Shape):
            glows = graph.children(shape, mi.ObjectType.Emitter)
            default = properties("diffuse", reflectance=0.0 if glows else 0.5)
            graph.attach(shape, "bsdf", graph.add(BSDF, default))


@dataclass(frozen=True)
class NearestPhong:
    """The phong material that replaces a BSDF; with values as in ``reference.scene.values``.

    ``lost`` are pairs of something that the textbook model has no form for, and the rule for the
    rest; nested BSDFs have their own. ``physical`` are parameters of the BSDF, as engines have
    them, for users' heuristics.
    """

    k_i: Any = 0.0
    k_a: Any = 0.0
    k_d: Any = 0.0
    k_s: Any = 0.0
    n: Any = 1.0
    form: str = "phong"
    normalised: bool = False
    twosided: bool = False
    transmittance: Any = 0.0
    tilt: Any = None
    lost: tuple[tuple[str, str], ...] = ()
    physical: dict[str, Any] = field(default_factory=dict)

    def properties(self) -> mi.Properties:
        """Return the properties of the node ``phong``, without defaults."""
        numbers = {name: getattr(self, name) for name in (*COEFFICIENTS, "n", "transmittance")}
        numbers = {k: v for k, v in numbers.items() if k in ("k_d", "n") or not values.is_zero(v)}
        for name in ("normalised", "twosided", "form"):
            if getattr(self, name) not in (False, "phong"):
                numbers[name] = getattr(self, name)
        if self.tilt is not None:
            numbers["tilt"] = self.tilt
        return properties("phong", **numbers, **self.physical)

    def parameters(self) -> dict[str, Any]:
        """Return the coefficients for records: numbers, or the word ``texture``."""
        parameters = {name: getattr(self, name) for name in ("k_a", "k_d", "k_s", "n")}
        if not values.is_zero(self.transmittance):
            parameters["transmittance"] = self.transmittance
        return {
            name: "texture" if values.plain(value) is None else values.plain(value)
            for name, value in parameters.items()
        }


@dataclass
class Context:
    """A graph that rules read and add nodes to, and the materials ``done`` so far, by node.

    ``rule_of(plugin)`` returns the rule of a BSDF that is not in :data:`RULES`. With ``for_users``
    materials also have their physical parameters.
    """

    graph: Graph
    convention: Convention
    rule_of: Callable[[str], "Rule"] | None = None
    for_users: bool = False
    done: dict[int, NearestPhong] = field(default_factory=dict)

    def nearest(self, index: int) -> NearestPhong:
        """Return the :class:`NearestPhong` of a BSDF node."""
        if index not in self.done:
            plugin = self.plugin(index)
            rule = RULES.get(plugin) or (self.rule_of and self.rule_of(plugin))
            assert rule, f"a rule for {plugin}"
            self.done[index] = rule(self, index)
        return self.done[index]

    def value(self, index: int, key: str, default: Any) -> Any:
        """Return a parameter as the parser keeps it."""
        return self.graph.props(index).get(key, default)

    def physical(
        self, base_color: Any = 0.0, alpha: Any = 1.0, ior: Any = 1.0, metallic: Any = 0.0
    ) -> dict[str, Any]:
        """Return physical parameters by their names, if users' heuristics read them.

        They stand for a surface that reflects nothing, without an interface, unless they are given.
        """
        parameters = {"base_color": base_color, "alpha": alpha, "ior": ior, "metallic": metallic}
        return parameters if self.for_users else {}

    def plugin(self, index: int) -> str:
        """Return a node's plugin."""
        return self.graph.plugin(index)

    def inner(self, index: int) -> list[NearestPhong]:
        """Return the materials of the nested BSDFs."""
        return [self.nearest(child) for _, child in self.graph.children(index, BSDF)]


Rule = Callable[[Context, int], NearestPhong]


def to_heuristic(context: Context, replaced: Replacements) -> None:
    """Replace the BSDFs of all shapes by the nearest ``phong``.

    What each BSDF loses is recorded under its label, and the partner of each that was neither
    ``phong`` nor made of others.
    """
    graph = context.graph
    for shape in graph.nodes(mi.ObjectType.Shape):
        for _, index in graph.children(shape, BSDF):
            context.nearest(index)
    for index, material in sorted(context.done.items()):
        label = graph.label(index)
        plugin = graph.plugin(index)
        if plugin not in ("phong", *WRAPPERS):
            is_diffuse = plugin == "diffuse"
            parameters = {"k_d": "reflectance"} if is_diffuse else material.parameters()
            replaced.bsdf(label, plugin, "phong", parameters)
        for lost, rule in material.lost:
            replaced.lose(label, plugin, lost, rule)
    # Only now, because labels and plugins in the records are those of the scene.
    for index, material in context.done.items():
        graph.replace(index, material.properties())


def to_physical(graph: Graph, convention: Convention, replaced: Replacements) -> None:
    """Replace every ``phong`` of the graph by its :func:`physical_partner`."""
    for index in graph.nodes(BSDF, "phong"):
        label = graph.label(index)
        before = graph.props(index)
        plugin, parameters, misses = physical_partner(graph, index, convention)
        replaced.misses += misses
        low, high = PLASTICS
        ior = parameters.get("int_ior", 1.5) / parameters.get("ext_ior", 1.0)
        note = f"no real plastic has the index {ior:.3g}: they have {low:g} to {high:g}"
        note = "" if low <= ior <= high else note
        recorded = {"reflectance": _base(before)} if plugin == "diffuse" else parameters
        replaced.bsdf(label, "phong", plugin, recorded, note)
        props = properties(plugin, **parameters)
        is_twosided = before.get("twosided", False)
        # A wrapper takes over the node, to which shapes already refer.
        graph.replace(index, mi.Properties("twosided") if is_twosided else props)
        if is_twosided:
            graph.attach(index, "bsdf", graph.add(BSDF, props))


def physical_partner(
    graph: Graph, index: int, convention: Convention
) -> tuple[str, dict[str, Any], tuple[Miss, ...]]:
    """Return plugin and parameters of the physical BSDF that replaces a ``phong``, and misses.

    It is ``diffuse`` without ``k_s``, and ``roughplastic`` with it. That of a mirror is a
    ``conductor`` that reflects ``k_s``, or a smooth ``plastic`` if there is a diffuse part, too.
    """
    if any(values.colour(graph, index, "k_s", 0.0)):
        from fotismos.reference.pairing import albedo  # loaded late: only lobes need it

        material = phong(graph, index)
        if material.n == inf and not any(material.k_d):
            reflected, misses = albedo.up_to_1("specular reflectance", material.k_s)
            return "conductor", {"material": "none", "specular_reflectance": reflected}, misses
        plastic, misses = albedo.to_roughplastic(material, convention)
        parameters = asdict(plastic)
        if plastic.alpha:
            return "roughplastic", parameters, misses
        del parameters["alpha"], parameters["distribution"]
        return "plastic", parameters, misses
    props = graph.props(index)
    return "diffuse", {"reflectance": props.get(_base(props), 0.0)}, ()


def _base(props: mi.Properties) -> str:
    return "k_d" if "k_d" in props and values.may_be_nonzero(props["k_d"]) else "k_a"


def phong(graph: Graph, index: int) -> Phong:
    """Read the parameters of a ``phong``, with the plugin's defaults."""
    props = graph.props(index)
    return Phong(
        k_d=values.colour(graph, index, "k_d", 0.0),
        k_s=values.colour(graph, index, "k_s", 0.0),
        n=inf if is_mirror(props) else values.number(graph, index, "n", 1.0),
        form=props.get("form", "phong"),
        normalised=props.get("normalised", False),
    )


def is_mirror(props: mi.Properties) -> bool:
    """Return whether a ``phong`` is a mirror (8.7)."""
    has_lobe = values.may_be_nonzero(props.get("k_s", 0.0))
    return has_lobe and values.plain(props.get("n", 1.0)) == inf


def itself(context: Context, index: int) -> NearestPhong:
    """``phong``: itself; physically its :func:`physical_partner`."""
    props = context.graph.props(index)
    physical = {}
    if context.for_users:
        plugin, partner, _ = physical_partner(context.graph, index, context.convention)
        if plugin == "diffuse":
            physical = context.physical(partner["reflectance"])
        elif plugin == "conductor":
            physical = context.physical(
                partner["specular_reflectance"], SMALLEST_ALPHA, metallic=1.0
            )
        else:
            alpha = partner.get("alpha", SMALLEST_ALPHA)
            ior = partner["int_ior"] / partner["ext_ior"]
            physical = context.physical(partner["diffuse_reflectance"], alpha, ior)
    names = ("k_i", "k_a", "k_d", "k_s", "n", "form", "normalised", "twosided", "transmittance")
    fields = {name: props[name] for name in (*names, "tilt") if name in props}
    lost = (UNSEEN,) if is_mirror(props) else ()
    return NearestPhong(**fields, lost=lost, physical=physical)


def diffuse(context: Context, index: int) -> NearestPhong:
    """``diffuse``: ``k_d = k_a = rho`` (exact)."""
    reflectance = context.value(index, "reflectance", 0.5)
    return NearestPhong(k_a=reflectance, k_d=reflectance, physical=context.physical(reflectance))


RULES: dict[str, Rule] = {"phong": itself, "diffuse": diffuse}
"""By plugin; other rules are in :mod:`fotismos.reference.pairing.nearest`."""
