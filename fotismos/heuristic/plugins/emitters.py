"""The emitter plugins: the lights ``heuristic_point``, ``_spot`` and ``_directional``, and a glow.

========================  ==================  =====================================================
Parameter                 Type (default)      Meaning
========================  ==================  =====================================================
``position``              point (0, 0, 0)     point and spot
``direction``             vector (0, 0, 1)    spot and directional: direction of travel
``intensity``             spectrum (1)        ``I_p``, display-linear
``diffuse_intensity``     spectrum            ``L_d`` of 6.6; ``intensity`` if omitted
``specular_intensity``    spectrum            ``L_s`` of 6.8; ``intensity`` if omitted
``scale``                 float (1)           factor on the intensities
``k0``, ``k1``, ``k2``    float (1, 0, 0)     point and spot: attenuation of 6.1
``clamped``               boolean (false)     the other form of 8.6, ``min(..., 1)``
``cutoff``                float (30)          spot: half angle of the cone, degrees
``exponent``              float (0)           spot: ``m`` of 6.4
``shell``                 float (0)           point and spot: radius in which nothing casts a shadow
``radius``                float (0)           point and spot: radius of the lamp, a sphere or disc
``half_u``, ``half_v``    vector (0, 0, 0)    point and spot: half the edges of a rectangular lamp
========================  ==================  =====================================================

``mitsuba.traverse`` shows all of these but the last two rows and ``clamped``, and intensities only
if they are given. Differentiable are intensities, ``scale``, ``k0`` to ``k2``, ``exponent`` and a
spot's ``direction``; the derivative ignores that the edge of the cone moves. As in Mitsuba's own
lights, ``position`` and the ``direction`` of parallel light are not differentiable, because the
integrator ``prb`` ignores that ``L`` and ``N.L`` change. The integrators ``direct``, ``path`` and
``heuristic`` take derivatives by them nevertheless, after a warning of Mitsuba's. ``cutoff`` and
``shell`` have no derivative. Python::

    {'type': 'heuristic_point', 'position': [-4.24, 0, 0], 'intensity': 1.0}

Under Mitsuba's integrators a light of intensity ``I_p`` arrives as irradiance ``pi I_p f_att``
(:mod:`fotismos.heuristic.convention`). ``light`` hands the same parameters to the kernel. A sample
of Mitsuba's has one colour, which is ``L_d``. So the sum of the chapters is there that of two
renderings: with ``k_s = 0``, and with ``k_d = 0`` and ``L_s`` in place of ``L_d``; emission and
ambient light belong in one of them.

``heuristic_glow`` is emission and ambient light of a shape (8.1, 8.2):

==============  ===================  ===============================================================
Parameter       Type (default)       Meaning
==============  ===================  ===============================================================
``k_i``         spectrum (0)         emission coefficient
``k_a``         spectrum (0)         ambient coefficient
``ambient``     spectrum (0)         ``I_a``
``twosided``    boolean (false)      glow on both sides
==============  ===================  ===============================================================

Neither term is reflection, so a BSDF cannot hold them. Attached to a shape, this emitter
shows ``k_i + I_a k_a`` where a camera ray hits the shape, and lights nothing: in the model,
emission and ambient light do not travel.
"""

from collections.abc import Sequence
from inspect import signature
from typing import Any

import drjit as dr
import mitsuba as mi

from fotismos.heuristic import convention, terms
from fotismos.heuristic.convention import Colour, Interaction, Mask, Number, Properties, Sample
from fotismos.heuristic.lights import (
    FAR,
    INTENSITIES,
    PLUGINS,
    UNATTENUATED,
    Derivative,
    Extent,
    Light,
    light_fields,
)
from fotismos.heuristic.plugins.coefficients import coefficient, emitted


def define() -> dict[str, Any]:
    """Return the classes for the current variant, by the plugins' names."""
    coefficients = dict(zip(("k0", "k1", "k2"), map(float, UNATTENUATED), strict=True))

    flags = {
        Derivative.SMOOTH: mi.ParamFlags.Differentiable,
        Derivative.EDGES: mi.ParamFlags.Differentiable | mi.ParamFlags.Discontinuous,
        Derivative.NONE: mi.ParamFlags.NonDifferentiable,
    }

    class HeuristicLight(mi.Emitter):
        """One of the kinds in :data:`fotismos.heuristic.lights.PLUGINS`, never hit by a ray."""

        def __init__(self, props: Properties) -> None:
            super().__init__(props)
            self.model = PLUGINS[props.plugin_name()]
            # Only those that are given: otherwise both terms share one intensity in the kernel.
            self.intensities = {
                name: emitted(props, name, 1.0)
                for name in INTENSITIES
                if name == "intensity" or name in props
            }
            self.numbers: list[str] = []  # names of the parameters that are opaque numbers
            self.names = signature(self.model).parameters.keys()
            self._keep(props, "scale", mi.Float, 1.0)
            self.fields = light_fields(self.model)
            for name, field in self.fields.items():
                if field.adds_nothing_at_0 and not props.get(name, 0.0) > 0:
                    setattr(self, name, 0)
                elif field.parameter:
                    self._keep(props, name, getattr(mi, field.parameter), field.default)
            if "attenuation" in self.names:
                self.clamped = props.get("clamped", False)
                # Without attenuation in the scene, the kernel holds none until an edit.
                self.unattenuated = all(props.get(k, d) == d for k, d in coefficients.items())
                for name, default in coefficients.items():
                    self._keep(props, name, mi.Float, default)
            if "extent" in self.names:
                self.extent = Extent(
                    radius=mi.Float(props.get("radius", 0.0)),
                    u=mi.Vector3f(props.get("half_u", 0.0)),
                    v=mi.Vector3f(props.get("half_v", 0.0)),
                )
                dr.make_opaque(self.extent)
            self.m_flags = +mi.EmitterFlags.DeltaPosition
            if self.model.parallel:
                self.m_flags = mi.EmitterFlags.Infinite | mi.EmitterFlags.DeltaDirection

        def parameters_changed(self, keys: Sequence[str] = ()) -> None:
            """Make edited numbers opaque, so new values compile nothing."""
            dr.make_opaque(*(getattr(self, name) for name in self.numbers))
            if coefficients.keys() & set(keys):
                self.unattenuated = False

        def traverse(self, callback: Any) -> None:
            numbers = {name: getattr(self, name) for name in self.numbers}
            for name, value in (self.intensities | numbers).items():
                # `scale` and the coefficients of the attenuation are no fields.
                field = self.fields.get(name)
                callback.put(name, value, +flags[field.derivative if field else Derivative.SMOOTH])

        def light(self, it: Interaction, active: Mask = True) -> Light:
            """Return the kernel's form of this light, at the wavelengths of an interaction."""
            # A light has no surface, so its spectra need only the wavelengths.
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wavelengths = it.wavelengths
            return self.model(
                **{
                    name: self.scale * intensity.eval(si, active)
                    for name, intensity in self.intensities.items()
                },
                **{name: getattr(self, name) for name in self.names - set(INTENSITIES)},
            )

        @property
        def attenuation(self) -> tuple[Number, ...]:
            """The coefficients of 6.1; plain numbers if they are 1, 0 and 0."""
            return UNATTENUATED if self.unattenuated else (self.k0, self.k1, self.k2)

        def sample_direction(self, it: Interaction, sample: Any, active: Mask = True) -> Sample:
            toward, intensity, _, distance = self.light(it, active).illuminate(mi.Vector3f(it.p))
            ds = dr.zeros(mi.DirectionSample3f)
            # Parallel light has no position: its point lies beyond any scene.
            ds.d, ds.dist = toward, FAR if isinstance(distance, float) else distance
            ds.p = it.p + toward * ds.dist
            ds.n = -toward
            ds.time = it.time
            # The only possible direction: a delta sample is not weighted against others.
            ds.pdf = 1.0
            ds.delta = True
            ds.emitter = mi.EmitterPtr(self)
            return ds, convention.IRRADIANCE_PER_INTENSITY * mi.Spectrum(intensity) & active

        def eval(self, si: Interaction, active: Mask = True) -> Colour:
            return mi.Spectrum(0)

        def pdf_direction(self, it: Interaction, ds: Any, active: Mask = True) -> Number:
            return mi.Float(0)

        def eval_direction(self, it: Interaction, ds: Any, active: Mask = True) -> Colour:
            return self.sample_direction(it, None, active)[1]  # Mitsuba takes derivatives here

        def bbox(self) -> Any:
            if self.model.parallel:
                return mi.ScalarBoundingBox3f()
            x, y, z = self.position
            return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(x[0], y[0], z[0]))

        def to_string(self) -> str:
            shown = ", ".join(f"{name} = {value}" for name, value in self.intensities.items())
            return f"{self.model.__name__}[{shown}]"

        def _keep(self, props: Properties, name: str, kind: Any, default: Any) -> None:
            """Read a parameter as an opaque number."""
            value = kind(props.get(name, default))
            dr.make_opaque(value)
            setattr(self, name, value)
            self.numbers.append(name)

    class HeuristicGlow(mi.Emitter):
        """See the module's docstring."""

        def __init__(self, props: Properties) -> None:
            super().__init__(props)
            self.k_i = emitted(props, "k_i", 0.0)
            self.k_a = coefficient(props, "k_a")
            self.ambient = emitted(props, "ambient", 0.0)
            self.twosided = props.get("twosided", False)
            self.m_flags = +mi.EmitterFlags.Surface

        def eval(self, si: Interaction, active: Mask = True) -> Colour:
            glow = terms.emission(self.k_i.eval(si, active)) + terms.ambient(
                self.ambient.eval(si, active), self.k_a.eval(si, active)
            )
            return dr.select(active & (self.twosided | (si.wi.z > 0)), glow, 0)

        def sample_direction(self, it: Interaction, sample: Any, active: Mask = True) -> Sample:
            return dr.zeros(mi.DirectionSample3f), mi.Spectrum(0)

        def pdf_direction(self, it: Interaction, ds: Any, active: Mask = True) -> Number:
            return mi.Float(0)

        def eval_direction(self, it: Interaction, ds: Any, active: Mask = True) -> Colour:
            return mi.Spectrum(0)

        def bbox(self) -> Any:
            return self.get_shape().bbox()

        def traverse(self, callback: Any) -> None:
            for name in ("k_i", "k_a", "ambient"):
                callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return f"HeuristicGlow[k_i = {self.k_i}, k_a = {self.k_a}, ambient = {self.ambient}]"

    return dict.fromkeys(PLUGINS, HeuristicLight) | {"heuristic_glow": HeuristicGlow}
