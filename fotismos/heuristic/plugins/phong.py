"""The BSDF plugin ``phong``: the chapters' material under Mitsuba's own integrators.

==================  ================  =============================================================
Parameter           Type (default)    Meaning
==================  ================  =============================================================
``k_i``, ``k_a``    spectrum (0)      emission and ambient coefficient; read by the integrator
                                      ``heuristic`` only, since they are not reflection
``k_d``, ``k_s``    spectrum or       diffuse and specular coefficient
                    texture (0)
``n``               float or          Phong's exponent; ``inf`` makes a mirror (8.7) that reflects
                    texture (1)       ``k_s``: a delta component
``form``            string (phong)    ``phong`` for ``(R.V)^n``, ``blinn`` for ``(N.H)^n``
``normalised``      boolean (false)   scale the lobe so that ``k_s`` is its albedo at normal
                                      incidence
``twosided``        boolean (false)   shade the side that faces the viewer, whichever it is
``transmittance``   spectrum or       share of the light that passes straight through, besides what
                    texture (0)       the other coefficients reflect: a null component
``tilt``            texture (none)    unit normal in the shading frame, such as ``heuristic_tilt``;
                                      read only by the integrator ``heuristic``
==================  ================  =============================================================

Coefficients, ``n`` and ``transmittance`` are exposed to ``mitsuba.traverse``. Python::

    {'type': 'phong', 'k_d': {'type': 'rgb', 'value': [0.5, 0.4, 0.3]}, 'k_s': 0.7, 'n': 9}

The reflected radiance for irradiance ``E`` at normal incidence is 8.10's for ``I_p = E / pi``
(:mod:`fotismos.heuristic.convention`): ``f cos = [k_d (N.L) + k_s (R.V)^n] / pi``. The specular
part has no cosine factor; as in the chapters, it neither conserves energy nor is reciprocal.
"""

from collections.abc import Sequence
from functools import reduce
from math import inf
from numbers import Real
from operator import or_
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic import convention, numerics, terms, vectors
from fotismos.heuristic.convention import (
    Colour,
    Direction,
    Interaction,
    Mask,
    Number,
    Properties,
    Sample,
)
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.materials import (
    COEFFICIENTS,
    Material,
    PairedMaterial,
    check_form,
    is_exponent,
)
from fotismos.heuristic.plugins.coefficients import (
    coefficient,
    emitted,
    may_be_nonzero,
    require_positive,
)

SMALLEST_SAMPLE = 2.0**-25
"""In place of a random number of 0, which represents all numbers below 2^-24."""


def define() -> dict[str, Any]:
    """Return the class for the current variant, by the plugin's name."""

    class PhongBSDF(mi.BSDF):
        """See the module's docstring."""

        def __init__(self, props: Properties) -> None:
            super().__init__(props)
            self.k_i = emitted(props, "k_i", 0.0)
            self.k_a = coefficient(props, "k_a")
            self.k_d = coefficient(props, "k_d")
            self.k_s = coefficient(props, "k_s")
            self.transmittance = coefficient(props, "transmittance")
            self.tilt = props.get_texture("tilt") if "tilt" in props else None
            self.n = _exponent(props)
            self.has_partner = "base_color" in props
            self.base_color = coefficient(props, "base_color") if self.has_partner else self.k_d
            self.partner = {
                name: _number(props, name, default) for name, default in PARTNER.items()
            }
            self.form = props.get("form", "phong")
            check_form(self.form)
            self.normalised = props.get("normalised", False)
            self.twosided = props.get("twosided", False)
            self.parameters_changed()

        def material(
            self, si: Interaction, active: Mask, prune: bool, form: str | None, physical: bool
        ) -> Material:
            """Return the material at a surface interaction; absent terms are plain zeros.

            ``k_s`` is that of a lobe without normalisation, 0 for a mirror. With ``physical`` the
            material is a :class:`fotismos.heuristic.materials.PairedMaterial`.
            """
            form = form or self.form
            n = self.exponent(si, active)
            coefficients = {
                name: getattr(self, name).eval(si, active)
                for name in (self.present if prune else self.kernel_terms)
            }
            if self.normalised and "k_s" in coefficients:
                coefficients["k_s"] = coefficients["k_s"] * terms.normalisation(form, n)
            if physical:
                coefficients["base_color"] = self.base_color.eval(si, active)
                coefficients |= {
                    name: value.eval_1(si, active) if isinstance(value, mi.Texture) else value
                    for name, value in self.partner.items()
                }
            kind = PairedMaterial if physical else Material
            return kind(**coefficients, n=n, form=form, n_is_moderate=self.n_is_moderate)

        def exponent(self, si: Interaction, active: Mask = True) -> Number:
            """Return ``n`` at a surface interaction; 1 for a mirror, which has no lobe."""
            if self.is_mirror:
                return mi.Float(1)
            if isinstance(self.n, mi.Texture):
                return dr.maximum(self.n.eval_1(si, active), 0)
            return self.n

        def eval(self, ctx: Any, si: Interaction, wo: Direction, active: Mask = True) -> Colour:
            wi, wo = self._facing(si.wi, wo)
            above = active & (wi.z > 0) & (wo.z > 0)
            value = mi.Spectrum(0)
            # Components are numbered as in `m_components`: 0 the lobe, 1 diffuse, 2 null.
            if "k_d" in self.present and ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 1):
                k_d = self.k_d.eval(si, above)
                value += terms.diffuse(convention.RADIANCE_PER_IRRADIANCE, k_d, wo.z)
            if "k_s" in self.present and ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                n = self.exponent(si, above)
                k_s = self.k_s.eval(si, above)
                if self.normalised:
                    k_s = k_s * terms.normalisation(self.form, n)
                cosine = vectors.local_lobe(self.form, self.n_is_moderate, wi, wo)
                value += terms.specular(convention.RADIANCE_PER_IRRADIANCE, k_s, cosine, n)
            return dr.select(above, value, 0)

        def pdf(self, ctx: Any, si: Interaction, wo: Direction, active: Mask = True) -> Number:
            wi, wo = self._facing(si.wi, wo)
            above = active & (wi.z > 0) & (wo.z > 0)
            # The mixture that `sample` draws from: null or not, then the lobe or the diffuse part.
            probability = self._specular_probability(ctx, si, above)
            reflected = 1 - self._through_probability(ctx, si, above)
            diffuse = mi.warp.square_to_cosine_hemisphere_pdf(wo)
            specular = self._lobe_pdf(wi, wo, self.exponent(si, above))
            return dr.select(above, reflected * dr.lerp(diffuse, specular, probability), 0)

        def sample(
            self, ctx: Any, si: Interaction, sample1: Number, sample2: Any, active: Mask = True
        ) -> Sample:
            if not self.is_clear:
                return self._reflected(ctx, si, sample1, sample2, active)
            probability = self._through_probability(ctx, si, active)
            passes = active & (sample1 < probability)
            # The rest of the number is uniform again, and chooses between the other two.
            sample1 = dr.select(passes, 0, (sample1 - probability) / (1 - probability))
            reflected, weight = self._reflected(ctx, si, sample1, sample2, active & ~passes)
            # Straight through: the density of a delta component is its chance.
            straight = dr.zeros(mi.BSDFSample3f)
            straight.wo = -si.wi
            straight.eta = 1.0
            straight.pdf = probability
            straight.sampled_component = mi.UInt32(2)
            straight.sampled_type = mi.UInt32(+mi.BSDFFlags.Null)
            passed = self.transmittance.eval(si, passes) / probability
            return dr.select(passes, straight, reflected), dr.select(passes, passed, weight)

        def eval_null_transmission(self, si: Interaction, active: Mask = True) -> Colour:
            return mi.Spectrum(self.transmittance.eval(si, active))

        def shading_normal(self, si: Interaction, active: Mask = True) -> Direction:
            """Return the normal in world space, with a bump or normal map applied."""
            if self.tilt is None:
                return mi.Vector3f(si.sh_frame.n)
            return mi.Vector3f(si.to_world(mi.Vector3f(self.tilt.eval_3(si, active))))

        def eval_pdf(
            self, ctx: Any, si: Interaction, wo: Direction, active: Mask = True
        ) -> tuple[Colour, Number]:
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo=wo, active=active)

        def eval_diffuse_reflectance(self, si: Interaction, active: Mask = True) -> Colour:
            return self.k_d.eval(si, active)

        def _reflected(
            self, ctx: Any, si: Interaction, sample1: Number, sample2: Any, active: Mask
        ) -> Sample:
            """Draw ``wo`` from the diffuse part and the lobe."""
            (wi,) = self._facing(si.wi)
            active = active & (wi.z > 0)
            # The first number chooses the part, the second the direction.
            probability = self._specular_probability(ctx, si, active)
            is_specular = sample1 < probability
            wo = dr.select(
                is_specular,
                mi.reflect(wi)
                if self.is_mirror
                else self._sample_lobe(wi, sample2, self.exponent(si, active)),
                mi.warp.square_to_cosine_hemisphere(sample2),
            )
            # From the front, where it was drawn, back to the viewer's side.
            if self.twosided:
                wo = dr.mulsign(wo, si.wi.z)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = wo
            bs.eta = 1.0
            bs.sampled_component = dr.select(is_specular, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(
                is_specular,
                mi.UInt32(+self.specular),
                mi.UInt32(+mi.BSDFFlags.DiffuseReflection),
            )
            # Value and density of both parts, whichever of them drew the direction.
            value, bs.pdf = self.eval_pdf(ctx, si, wo=wo, active=active)
            # A mirror has no density over solid angle: its chance takes the place.
            if self.is_mirror:
                mirrored = terms.mirror(1, self.k_s.eval(si, active))
                value = dr.select(is_specular, mirrored, value)
                share = probability * (1 - self._through_probability(ctx, si, active))
                bs.pdf = dr.select(is_specular, share, bs.pdf)
            active &= bs.pdf > 0
            return bs, dr.select(active, value / bs.pdf, 0)

        def traverse(self, callback: Any) -> None:
            parameters = {
                name: getattr(self, name) for name in (*COEFFICIENTS, "n", "transmittance")
            }
            partner = {"base_color": self.base_color} | self.partner if self.has_partner else {}
            for name, value in (parameters | partner).items():
                callback.put(name, value, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys: Sequence[str] = ()) -> None:
            """Note which coefficients can be non-zero, if it is a mirror, and make ``n`` opaque.

            An opaque exponent can change without a new compilation, unless it crosses the bounds of
            :data:`fotismos.heuristic.numerics.MODERATE_EXPONENTS`. Values below 0 raise InputError.
            """
            for name in (*COEFFICIENTS, "transmittance"):
                require_positive(f"phong: {name}", getattr(self, name))
            self.is_clear = may_be_nonzero(self.transmittance)
            self.n_is_moderate = self.is_mirror = False
            dr.make_opaque(
                [value for value in self.partner.values() if isinstance(value, mi.Float)]
            )
            if not isinstance(self.n, mi.Texture):
                dr.make_opaque(self.n)
                exponents = np.ravel(self.n).tolist()
                for n in exponents:
                    _require_exponent(n)
                self.is_mirror = inf in exponents
                self.n_is_moderate = self.is_mirror or all(map(numerics.is_moderate, exponents))
            # A mirror has no lobe, so the kernel gets no `k_s` of it.
            self.kernel_terms = [k for k in COEFFICIENTS if k != "k_s" or not self.is_mirror]
            self.present = {k for k in self.kernel_terms if may_be_nonzero(getattr(self, k))}
            # The lobe or mirror, the diffuse part and the null component, in this order.
            front = mi.BSDFFlags.FrontSide
            back = mi.BSDFFlags.BackSide
            sides = front | (back if self.twosided else 0)
            flags = mi.BSDFFlags
            self.specular = flags.DeltaReflection if self.is_mirror else flags.GlossyReflection
            components = [self.specular | sides, flags.DiffuseReflection | sides]
            if self.is_clear:
                components.append(flags.Null | front | back)
            self.m_components = components  # Mitsuba copies the list
            self.m_flags = reduce(or_, components)

        def to_string(self) -> str:
            parts = ", ".join(f"{name} = {getattr(self, name)}" for name in (*COEFFICIENTS, "n"))
            return f"PhongBSDF[{parts}, twosided = {self.twosided}]"

        def _facing(self, wi: Direction, *directions: Direction) -> tuple[Direction, ...]:
            """Turn directions to the viewer's side if both sides are shaded."""
            if not self.twosided:
                return wi, *directions
            return tuple(dr.mulsign(direction, wi.z) for direction in (wi, *directions))

        def _specular_probability(self, ctx: Any, si: Interaction, active: Mask) -> Number:
            """Share of samples for the lobe: its part of the albedo at normal incidence."""
            has_specular = "k_s" in self.present or self.is_mirror
            if not (has_specular and ctx.is_enabled(self.specular, 0)):
                return mi.Float(0)
            if not ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 1) or "k_d" not in self.present:
                return mi.Float(1)
            diffuse, specular = self._albedos(si, active)
            total = diffuse + specular
            return dr.select(total > 0, specular / total, 0.5)

        def _through_probability(self, ctx: Any, si: Interaction, active: Mask) -> Number:
            """Share of samples that pass straight through."""
            if not self.is_clear or not ctx.is_enabled(mi.BSDFFlags.Null, 2):
                return mi.Float(0)
            clear = dr.mean(self.transmittance.eval(si, active))
            total = clear + sum(self._albedos(si, active))
            return dr.select(total > 0, clear / total, 0)

        def _albedos(self, si: Interaction, active: Mask) -> tuple[Number, Number]:
            """Return the albedo of the two parts at normal incidence, the mean over channels."""
            k_d = dr.mean(self.k_d.eval(si, active))
            k_s = dr.mean(self.k_s.eval(si, active))
            if self.is_mirror or self.normalised:
                return k_d, k_s
            # `k_s` of a plain lobe is its albedo times the normalisation.
            return k_d, k_s * (1 / terms.normalisation(self.form, self.exponent(si, active)))

        def _sample_lobe(self, wi: Direction, sample2: Any, n: Number) -> Direction:
            """Draw ``wo``: its lobe vector has the density ``(n + 1) / (2 pi) cos^n``.

            That vector is ``wo`` itself about the mirror image of ``wi``, or the half vector about
            the normal, at which ``wi`` is then mirrored. Its cosine is ``u^(1/(n + 1))``, whose ``1
            - c^2`` would vanish for large ``n``: with ``c = 2^-x`` the sine comes from ``1 -
            2^(-2x)`` (:func:`fotismos.heuristic.numerics.one_less_exp2`).
            """
            # `u = c^(n + 1)` and `c = 2^-x` give `x = -log2(u) / (n + 1)`.
            halvings = -dr.log2(numerics.at_least(sample2.y, SMALLEST_SAMPLE)) / (n + 1)
            sine = dr.sqrt(numerics.one_less_exp2(2 * halvings))
            cosine = numerics.exp2(-halvings)
            sin_phi, cos_phi = dr.sincos(dr.two_pi * sample2.x)
            local = mi.Vector3f(cos_phi * sine, sin_phi * sine, cosine)
            if self.form == "blinn":
                return mi.Vector3f(vectors.normalise(mi.reflect(wi, local)))
            return mi.Vector3f(vectors.normalise(mi.Frame3f(mi.reflect(wi)).to_world(local)))

        def _lobe_pdf(self, wi: Direction, wo: Direction, n: Number) -> Number:
            """Density of ``wo``; mirroring at ``H`` spreads solid angle by ``4 (wi.H)``.

            ``wi.H = |wi + wo| / 2``, which is 0 only for opposite directions. A mirror has none.
            """
            if self.is_mirror:
                return mi.Float(0)
            cosine = vectors.local_lobe(self.form, self.n_is_moderate, wi, wo)
            density = (n + 1) * dr.inv_two_pi * numerics.power(cosine, n)
            if self.form == "blinn":
                density /= numerics.at_least(2 * dr.norm(wi + wo), numerics.smallest(wo))
            return density

    return {"phong": PhongBSDF}


PARTNER = {"alpha": 1.0, "ior": 1.0, "metallic": 0.0}
"""Single numbers of the physical partner, with their defaults."""


def _number(props: Properties, name: str, default: float) -> Any:
    """Read a number that may vary over the surface."""
    value = props.get(name, default)
    return mi.Float(value) if isinstance(value, Real) else props.get_unbounded_texture(name)


def _exponent(props: Properties) -> Any:
    """Read ``n``: a number, or a texture."""
    n = props.get("n", 1.0)
    if not isinstance(n, Real):
        return props.get_unbounded_texture("n")
    _require_exponent(n)
    return mi.Float(n)


def _require_exponent(n: Number) -> None:
    if not is_exponent(n):
        raise InputError(
            f"phong: n = {n} is not allowed: give 0 or more, at most"
            f" {numerics.LARGEST_EXPONENT:.2g}; inf makes a mirror."
        )
