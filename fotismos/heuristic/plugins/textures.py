"""Textures that compute a coefficient from other textures, point by point.

=======================  ==================================  =======================================
Plugin                   Operands                            Value
=======================  ==================================  =======================================
``heuristic_product``    ``a``, ``b``                        ``a b``
``heuristic_share``      ``a``, scalar ``weight``            ``a weight``
``heuristic_rest``       ``a``, scalar ``weight``            ``a (1 - weight)``
``heuristic_sum``        ``a``, ``b``                        ``a + b``
``heuristic_blend``      ``a``, ``b``, scalar ``weight``     ``a (1 - weight) + b weight``
``heuristic_sides``      ``front``, ``back``                 the value of the side that is seen
``heuristic_exponent``   scalar ``alpha``                    ``(1 / alpha^2 - 1) / 2``, 0 or more
``heuristic_interior``   ``rho``; numbers ``scale``,         ``scale rho / (1 - rho return)``
                         ``return``
=======================  ==================================  =======================================

Operands are numbers, colours or textures. Scalars are read as Mitsuba reads an ``alpha`` or an
opacity (``eval_1``), weights clipped to [0, 1], the others in the requested form.

Also here is ``heuristic_tilt``: the shading normal from a bump or normal map.

==================  ==================  ============================================================
Parameter           Type                Meaning
==================  ==================  ============================================================
``normals``         texture             a normal map: the local normal, 0..1 for -1..1
``heights``         texture             a bump map: displacement along the normal
``scale``           float (1)           factor on the heights
``flip``            boolean (true)      turn a normal that a map turns away from the viewer to the
                                        viewer's side
==================  ==================  ============================================================

One of ``normals`` and ``heights`` is given. ``eval_3`` is the unit normal in the shading frame, as
Mitsuba's ``normalmap`` and ``bumpmap`` define it (Blinn 1978): for heights ``h`` the normal of the
displaced surface is ``(dp/du + dh/du n) x (dp/dv + dh/dv n)``.
"""

from collections.abc import Callable
from numbers import Real
from typing import Any

import drjit as dr
import mitsuba as mi

from fotismos.heuristic.convention import Colour, Direction, Interaction, Mask, Number, Properties
from fotismos.heuristic.materials import SMALLEST_ALPHA
from fotismos.heuristic.plugins.coefficients import coefficient

SCALARS = ("weight", "alpha")
MAPS = ("normals", "heights")
LARGEST = 1e9


def _exponent(si: Interaction, alpha: Number) -> Number:
    alpha = dr.maximum(alpha, SMALLEST_ALPHA)
    return dr.maximum((1 / dr.square(alpha) - 1) / 2, 0)


OPERATIONS: dict[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "heuristic_product": (("a", "b"), lambda si, a, b: a * b),
    "heuristic_share": (("a", "weight"), lambda si, a, weight: a * dr.clip(weight, 0, 1)),
    "heuristic_rest": (("a", "weight"), lambda si, a, weight: a * (1 - dr.clip(weight, 0, 1))),
    "heuristic_sum": (("a", "b"), lambda si, a, b: a + b),
    "heuristic_blend": (
        ("a", "b", "weight"),
        lambda si, a, b, weight: dr.lerp(a, b, dr.clip(weight, 0, 1)),
    ),
    "heuristic_sides": (
        ("front", "back"),
        lambda si, front, back: dr.select(si.wi.z > 0, front, back),
    ),
    "heuristic_exponent": (("alpha",), _exponent),
    "heuristic_interior": (
        ("rho", "scale", "return"),
        lambda si, rho, scale, returned: scale * rho / (1 - returned * rho),
    ),
}
"""The operands of each plugin, and the function that computes its value from them."""


def define() -> dict[str, Any]:
    """Return the classes for the current variant, by the plugins' names."""

    class Computed(mi.Texture):
        """See the module's docstring."""

        def __init__(self, props: Properties) -> None:
            super().__init__(props)
            names, self.operation = OPERATIONS[props.plugin_name()]
            self.operands = {
                name: props[name] if isinstance(props[name], Real) else coefficient(props, name)
                for name in names
            }

        def eval(self, si: Interaction, active: Mask = True) -> Colour:
            return mi.Spectrum(self._value("eval", si, active))

        def eval_1(self, si: Interaction, active: Mask = True) -> Number:
            return mi.Float(self._value("eval_1", si, active))

        def eval_3(self, si: Interaction, active: Mask = True) -> Colour:
            return mi.Color3f(self._value("eval_3", si, active))

        def is_spatially_varying(self) -> bool:
            return True

        def mean(self) -> Number:
            return mi.Float(0.5)

        def max(self) -> float:
            return LARGEST

        def traverse(self, callback: Any) -> None:
            for name, operand in self.operands.items():
                if isinstance(operand, mi.Texture):
                    callback.put(name, operand, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return f"{type(self).__name__}[{', '.join(map(str, self.operands))}]"

        def _value(self, method: str, si: Interaction, active: Mask) -> Any:
            values = [
                getattr(operand, "eval_1" if name in SCALARS else method)(si, active)
                if isinstance(operand, mi.Texture)
                else operand
                for name, operand in self.operands.items()
            ]
            return self.operation(si, *values)

    class Tilt(mi.Texture):
        """See the module's docstring."""

        def __init__(self, props: Properties) -> None:
            super().__init__(props)
            self.maps = {name: props.get_texture(name) for name in MAPS if name in props}
            self.scale = props.get("scale", 1.0)
            self.flip = props.get("flip", True)

        def eval_3(self, si: Interaction, active: Mask = True) -> Colour:
            if "normals" in self.maps:
                normal = dr.normalize(mi.Vector3f(self.maps["normals"].eval_3(si, active)) * 2 - 1)
            else:
                normal = self._displaced(si, active)
            if self.flip:
                # A half turn about the surface's normal, which keeps the slope.
                mirrored = mi.Vector3f(-normal.x, -normal.y, normal.z)
                normal = dr.select(dr.dot(normal, si.wi) * si.wi.z > 0, normal, mirrored)
            return mi.Color3f(normal)

        def is_spatially_varying(self) -> bool:
            return True

        def traverse(self, callback: Any) -> None:
            for name, value in self.maps.items():
                callback.put(name, value, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return f"Tilt[{self.maps}]"

        def _displaced(self, si: Interaction, active: Mask) -> Direction:
            slope = self.scale * self.maps["heights"].eval_1_grad(si, active)
            n = mi.Vector3f(si.sh_frame.n)
            # The rise replaces what the tangents have along the shading normal.
            along_u = si.dp_du + n * (slope.x - dr.dot(n, si.dp_du))
            along_v = si.dp_dv + n * (slope.y - dr.dot(n, si.dp_dv))
            normal = dr.normalize(dr.cross(along_u, along_v))
            # Onto the side of the geometric normal: a parametrisation may be left-handed.
            normal = dr.mulsign(normal, dr.dot(si.n, normal))
            return si.to_local(normal)

    return dict.fromkeys(OPERATIONS, Computed) | {"heuristic_tilt": Tilt}
