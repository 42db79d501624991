"""The emitter plugins ``heuristic_point``, ``heuristic_spot`` and ``heuristic_directional``.

========================  ==================  =====================================================
Parameter                 Type (default)      Meaning
========================  ==================  =====================================================
``position``              point (0, 0, 0)     point and spot
``direction``             vector (0, 0, 1)    spot and directional: direction of travel
``intensity``             spectrum (1)        ``I_p``, display-linear
``scale``                 float (1)           factor on the intensity
``k0``, ``k1``, ``k2``    float (1, 0, 0)     point and spot: attenuation of 6.1
``clamped``               boolean (false)     the other form of 8.6, ``min(..., 1)``
``cutoff``                float (30)          spot: half angle of the cone, degrees
``exponent``              float (0)           spot: ``m`` of 6.4
========================  ==================  =====================================================

Position, direction, intensity and the coefficients are exposed to ``mitsuba.traverse``. Python::

    {'type': 'heuristic_point', 'position': [-4.24, 0, 0], 'intensity': 1.0}

Under Mitsuba's integrators a light of intensity ``I_p`` arrives as irradiance ``pi I_p f_att``
(:mod:`heuristic.convention`). :meth:`light` hands the same parameters to the kernel.
"""

import drjit as dr
import mitsuba as mi

from heuristic import numerics, terms, vectors
from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.lights import UNATTENUATED, DirectionalLight, PointLight, SpotLight
from heuristic.plugins.spectra import emitted

FAR = 1e8
"""Where shadow rays of parallel light end: outside any scene. Mitsuba does not tell a plugin in
Python how large the scene is, and rays of this length still keep their direction to 1e-7."""

KINDS = ("heuristic_point", "heuristic_spot", "heuristic_directional")


def define():
    """Create the classes for the current variant and register them."""

    class HeuristicEmitter(mi.Emitter):
        """What the three kinds share: a position-free delta light that is never hit by a ray."""

        def __init__(self, props):
            super().__init__(props)
            self.intensity = emitted(props, "intensity", 1.0)
            self.scale = mi.Float(props.get("scale", 1.0))
            dr.make_opaque(self.scale)

        def parameters_changed(self, keys=()):
            """Make edited numbers opaque, so that a new value compiles nothing."""
            dr.make_opaque(self.scale)

        def eval(self, si, active=True):
            return mi.Spectrum(0)

        def pdf_direction(self, it, ds, active=True):
            return mi.Float(0)

        def eval_direction(self, it, ds, active=True):
            return mi.Spectrum(0)

        def to_string(self):
            return f"{type(self).__name__}[intensity = {self.intensity}]"

        def _spectrum(self, it, active):
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wavelengths = it.wavelengths
            return self.scale * self.intensity.eval(si, active)

        def _direction_sample(self, it, position, direction, distance):
            ds = dr.zeros(mi.DirectionSample3f)
            ds.p, ds.d, ds.dist = position, direction, distance
            ds.n = -direction
            ds.time = it.time
            ds.pdf = 1.0
            ds.delta = True
            ds.emitter = mi.EmitterPtr(self)
            return ds

    class HeuristicPoint(HeuristicEmitter):
        """Equation 6.1, and both forms of attenuation of 8.6."""

        def __init__(self, props):
            super().__init__(props)
            self.position = mi.Point3f(props.get("position", mi.ScalarPoint3f(0)))
            names = ("k0", "k1", "k2")
            given = tuple(
                props.get(name, float(default))
                for name, default in zip(names, UNATTENUATED, strict=True)
            )
            self.k0, self.k1, self.k2 = map(mi.Float, given)
            self.clamped = props.get("clamped", False)
            self.unattenuated = given == UNATTENUATED
            self.m_flags = +mi.EmitterFlags.DeltaPosition
            dr.make_opaque(self.position, self.k0, self.k1, self.k2)

        def sample_direction(self, it, sample, active=True):
            # Divided by its largest component first: the square need not lie in the type's range.
            half = 0.5 * self.position - 0.5 * it.p
            size = dr.max(abs(half))
            is_away = size >= numerics.smallest(size)
            half /= dr.select(is_away, size, 1)
            length = dr.norm(half)
            direction = half * dr.select(is_away, dr.rcp(length), 0)
            distance = numerics.at_most(2 * length * size, numerics.largest(length))
            ds = self._direction_sample(it, self.position, direction, distance)
            weight = self._attenuated(distance, self._spectrum(it, active))
            return ds, IRRADIANCE_PER_INTENSITY * weight & active

        def light(self, si, active=True):
            """Return the kernel's form of this light."""
            return PointLight(
                self.position, self._spectrum(si, active), self._coefficients(), self.clamped
            )

        def traverse(self, callback):
            for name in ("position", "intensity", "scale", "k0", "k1", "k2"):
                callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys=()):
            super().parameters_changed(keys)
            self.unattenuated = self.unattenuated and not {"k0", "k1", "k2"} & set(keys)
            dr.make_opaque(self.position, self.k0, self.k1, self.k2)

        def bbox(self):
            return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(*(c[0] for c in self.position)))

        def _coefficients(self):
            return UNATTENUATED if self.unattenuated else (self.k0, self.k1, self.k2)

        def _attenuated(self, distance, intensity):
            law = terms.clamped_attenuation if self.clamped else terms.attenuation
            return law(distance, *self._coefficients(), intensity)

    class HeuristicSpot(HeuristicPoint):
        """Equations 6.2-6.4."""

        def __init__(self, props):
            super().__init__(props)
            self.direction = mi.Vector3f(props.get("direction", mi.ScalarVector3f(0, 0, 1)))
            self.cutoff = mi.Float(props.get("cutoff", 30.0))
            self.exponent = mi.Float(props.get("exponent", 0.0))
            dr.make_opaque(self.direction, self.cutoff, self.exponent)

        def sample_direction(self, it, sample, active=True):
            ds, weight = super().sample_direction(it, sample, active)
            frame = mi.Frame3f(vectors.normalise(self.direction))
            local = frame.to_local(-ds.d)
            # 1 - cos and 1 + cos as halves of squared distances from the axis' two ends.
            away = dr.square(local.x) + dr.square(local.y)
            cos_axis = numerics.Cosine(
                local.z,
                0.5 * (away + dr.square(1 - local.z)),
                0.5 * (away + dr.square(1 + local.z)),
            )
            cone = terms.spot_cone(cos_axis, numerics.cosine_of_degrees(self.cutoff))
            return ds, weight * cone * terms.spot_falloff(cos_axis, self.exponent)

        def parameters_changed(self, keys=()):
            super().parameters_changed(keys)
            dr.make_opaque(self.direction, self.cutoff, self.exponent)

        def light(self, si, active=True):
            return SpotLight(
                self.position,
                self.direction,
                self._spectrum(si, active),
                self.cutoff,
                self.exponent,
                self._coefficients(),
                self.clamped,
            )

        def traverse(self, callback):
            super().traverse(callback)
            for name in ("direction", "cutoff", "exponent"):
                callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

    class HeuristicDirectional(HeuristicEmitter):
        """A directional light: parallel rays of constant intensity."""

        def __init__(self, props):
            super().__init__(props)
            self.direction = mi.Vector3f(props.get("direction", mi.ScalarVector3f(0, 0, 1)))
            self.m_flags = mi.EmitterFlags.Infinite | mi.EmitterFlags.DeltaDirection
            dr.make_opaque(self.direction)

        def sample_direction(self, it, sample, active=True):
            direction = -vectors.normalise(self.direction)
            ds = self._direction_sample(it, it.p + direction * FAR, direction, FAR)
            return ds, self._spectrum(it, active) * IRRADIANCE_PER_INTENSITY & active

        def parameters_changed(self, keys=()):
            super().parameters_changed(keys)
            dr.make_opaque(self.direction)

        def light(self, si, active=True):
            """Return the kernel's form of this light."""
            return DirectionalLight(self.direction, self._spectrum(si, active))

        def traverse(self, callback):
            for name in ("direction", "intensity", "scale"):
                callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

        def bbox(self):
            return mi.ScalarBoundingBox3f()

    for name, plugin in zip(
        KINDS, (HeuristicPoint, HeuristicSpot, HeuristicDirectional), strict=True
    ):
        mi.register_emitter(name, plugin)
