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

import drjit as dr
import mitsuba as mi

SMALLEST_ALPHA = 1e-4
"""Mitsuba replaces every smaller roughness by this one."""

SCALARS = ("weight", "alpha")
LARGEST = 1e9


def _exponent(si, alpha):
    alpha = dr.maximum(alpha, SMALLEST_ALPHA)
    return dr.maximum((1 / dr.square(alpha) - 1) / 2, 0)


OPERATIONS = {
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
}

KINDS = (*OPERATIONS, "heuristic_interior")


def define() -> None:
    """Create the classes for the current variant and register them."""
    _define_tilt()

    class Mapped(mi.Texture):
        """See the module's docstring."""

        operands: tuple[str, ...] = ()

        def __init__(self, props):
            super().__init__(props)
            self.children = {name: _operand(props, name) for name in self.operands}

        def value(self, si, *operands):
            """Return the value for the values of the operands."""
            raise NotImplementedError

        def eval(self, si, active=True):
            return mi.Spectrum(self._value("eval", si, active))

        def eval_1(self, si, active=True):
            return mi.Float(self._value("eval_1", si, active))

        def eval_3(self, si, active=True):
            return mi.Color3f(self._value("eval_3", si, active))

        def is_spatially_varying(self):
            return True

        def mean(self):
            return mi.Float(0.5)

        def max(self):
            return LARGEST

        def traverse(self, callback):
            for name, child in self.children.items():
                callback.put(name, child, mi.ParamFlags.Differentiable)

        def to_string(self):
            return f"{type(self).__name__}[{', '.join(map(str, self.children))}]"

        def _value(self, method, si, active):
            found = [
                getattr(child, "eval_1" if name in SCALARS else method)(si, active)
                for name, child in self.children.items()
            ]
            return self.value(si, *found)

    def operation(names, function):
        class Operation(Mapped):
            """One of :data:`OPERATIONS`."""

            operands = names

            def value(self, si, *operands):
                return function(si, *operands)

        return Operation

    class Interior(Mapped):
        """Light that leaves a diffuse base after any number of inner reflections."""

        operands = ("rho",)

        def __init__(self, props):
            super().__init__(props)
            self.scale, self.returned = props["scale"], props["return"]

        def value(self, si, rho):
            return self.scale * rho / (1 - self.returned * rho)

    for name, (names, function) in OPERATIONS.items():
        mi.register_texture(name, operation(names, function))
    mi.register_texture("heuristic_interior", Interior)


def _operand(props, name):
    """Read an operand; plain numbers and colours may be larger than a reflectance."""
    value = props[name]
    is_colour = isinstance(value, mi.ScalarColor3f | mi.ScalarColor3d)
    components = tuple(value) if is_colour else (value,)
    if all(isinstance(part, (int, float)) for part in components) and max(components) > 1:
        return props.get_unbounded_texture(name)
    return props.get_texture(name)


def _define_tilt():
    """Create the class of ``heuristic_tilt`` for the current variant and register it."""

    class Tilt(mi.Texture):
        """See the module's docstring."""

        def __init__(self, props):
            super().__init__(props)
            self.normals = props.get_texture("normals") if "normals" in props else None
            self.heights = props.get_texture("heights") if "heights" in props else None
            self.scale = props.get("scale", 1.0)
            self.flip = props.get("flip", True)

        def eval_3(self, si, active=True):
            normal = self._mapped(si, active) if self.normals else self._displaced(si, active)
            if self.flip:
                normal = dr.select(dr.dot(normal, si.wi) * si.wi.z > 0, normal, _mirrored(normal))
            return mi.Color3f(normal)

        def is_spatially_varying(self):
            return True

        def traverse(self, callback):
            for name in ("normals", "heights"):
                if getattr(self, name):
                    callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

        def to_string(self):
            return f"Tilt[normals = {self.normals}, heights = {self.heights}]"

        def _mapped(self, si, active):
            return dr.normalize(mi.Vector3f(self.normals.eval_3(si, active)) * 2 - 1)

        def _displaced(self, si, active):
            slope = self.scale * self.heights.eval_1_grad(si, active)
            n = mi.Vector3f(si.sh_frame.n)
            across = [
                dp + n * (rise - dr.dot(n, dp))
                for dp, rise in ((si.dp_du, slope.x), (si.dp_dv, slope.y))
            ]
            normal = dr.normalize(dr.cross(*across))
            normal = dr.mulsign(normal, dr.dot(si.n, normal))
            return si.to_local(normal)

    mi.register_texture("heuristic_tilt", Tilt)


def _mirrored(normal):
    return mi.Vector3f(-normal.x, -normal.y, normal.z)
