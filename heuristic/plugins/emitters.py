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
from heuristic.light import Light
from heuristic.lights import UNATTENUATED, DirectionalLight, PointLight, SpotLight
from heuristic.plugins.spectra import emitted

FAR = 1e8
"""Where shadow rays of parallel light end: outside any scene. Mitsuba does not tell a plugin in
Python how large the scene is, and rays of this length still keep their direction to 1e-7."""


def define() -> None:
    """Create the classes for the current variant and register them."""

    def registered(plugin: type) -> type:
        mi.register_emitter(plugin.model.plugin, plugin)
        return plugin

    class HeuristicEmitter(mi.Emitter):
        """What all kinds share: a position-free delta light that is never hit by a ray."""

        model: type[Light]

        def __init__(self, props):
            super().__init__(props)
            self.intensity = emitted(props, "intensity", 1.0)
            self.numbers = []  # names of the parameters that are opaque numbers
            self._keep(props, "scale", mi.Float, 1.0)

        def parameters_changed(self, keys=()):
            """Make edited numbers opaque, so that a new value compiles nothing."""
            dr.make_opaque(*(getattr(self, name) for name in self.numbers))

        def traverse(self, callback):
            for name in ("intensity", *self.numbers):
                callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

        def eval(self, si, active=True):
            return mi.Spectrum(0)

        def pdf_direction(self, it, ds, active=True):
            return mi.Float(0)

        def eval_direction(self, it, ds, active=True):
            return mi.Spectrum(0)

        def to_string(self):
            return f"{type(self).__name__}[intensity = {self.intensity}]"

        def _keep(self, props, name, kind, default):
            """Read a parameter as an opaque number."""
            value = kind(props.get(name, default))
            dr.make_opaque(value)
            setattr(self, name, value)
            self.numbers.append(name)

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

    @registered
    class HeuristicPoint(HeuristicEmitter):
        """Equation 6.1, and both forms of attenuation of 8.6."""

        model = PointLight

        def __init__(self, props):
            super().__init__(props)
            self._keep(props, "position", mi.Point3f, mi.ScalarPoint3f(0))
            defaults = dict(zip(("k0", "k1", "k2"), map(float, UNATTENUATED), strict=True))
            for name, default in defaults.items():
                self._keep(props, name, mi.Float, default)
            self.clamped = props.get("clamped", False)
            self.unattenuated = all(props.get(name, d) == d for name, d in defaults.items())
            self.m_flags = +mi.EmitterFlags.DeltaPosition

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

        def parameters_changed(self, keys=()):
            super().parameters_changed(keys)
            self.unattenuated = self.unattenuated and not {"k0", "k1", "k2"} & set(keys)

        def bbox(self):
            return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(*(c[0] for c in self.position)))

        def _coefficients(self):
            return UNATTENUATED if self.unattenuated else (self.k0, self.k1, self.k2)

        def _attenuated(self, distance, intensity):
            law = terms.clamped_attenuation if self.clamped else terms.attenuation
            return law(distance, *self._coefficients(), intensity)

    @registered
    class HeuristicSpot(HeuristicPoint):
        """Equations 6.2-6.4."""

        model = SpotLight

        def __init__(self, props):
            super().__init__(props)
            self._keep(props, "direction", mi.Vector3f, mi.ScalarVector3f(0, 0, 1))
            self._keep(props, "cutoff", mi.Float, 30.0)
            self._keep(props, "exponent", mi.Float, 0.0)

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

    @registered
    class HeuristicDirectional(HeuristicEmitter):
        """A directional light: parallel rays of constant intensity."""

        model = DirectionalLight

        def __init__(self, props):
            super().__init__(props)
            self._keep(props, "direction", mi.Vector3f, mi.ScalarVector3f(0, 0, 1))
            self.m_flags = mi.EmitterFlags.Infinite | mi.EmitterFlags.DeltaDirection

        def sample_direction(self, it, sample, active=True):
            direction = -vectors.normalise(self.direction)
            ds = self._direction_sample(it, it.p + direction * FAR, direction, FAR)
            return ds, self._spectrum(it, active) * IRRADIANCE_PER_INTENSITY & active

        def light(self, si, active=True):
            """Return the kernel's form of this light."""
            return DirectionalLight(self.direction, self._spectrum(si, active))

        def bbox(self):
            return mi.ScalarBoundingBox3f()
