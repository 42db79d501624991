"""The emitter plugin ``heuristic_glow``: emission and ambient light of a shape (8.1, 8.2).

==============  ===================  ===============================================================
Parameter       Type (default)       Meaning
==============  ===================  ===============================================================
``k_i``         spectrum (0)         emission coefficient
``k_a``         spectrum (0)         ambient coefficient
``ambient``     spectrum (0)         ``I_a``
``twosided``    boolean (false)      glow on both sides
==============  ===================  ===============================================================

Neither term is a matter of reflection, so no BSDF can hold them. Attached to a shape, this emitter
shows ``k_i + I_a k_a`` where a camera ray meets the shape, and lights nothing: in the model,
emission and ambient light do not travel.
"""

import drjit as dr
import mitsuba as mi

from heuristic import terms
from heuristic.plugins.spectra import coefficient, emitted


def define():
    """Create the class for the current variant and register it."""

    class HeuristicGlow(mi.Emitter):
        """See the module's docstring."""

        def __init__(self, props):
            super().__init__(props)
            self.k_i = emitted(props, "k_i", 0.0)
            self.k_a = coefficient(props, "k_a")
            self.ambient = emitted(props, "ambient", 0.0)
            self.twosided = props.get("twosided", False)
            self.m_flags = +mi.EmitterFlags.Surface

        def eval(self, si, active=True):
            glow = terms.emission(self.k_i.eval(si, active)) + terms.ambient(
                self.ambient.eval(si, active), self.k_a.eval(si, active)
            )
            return dr.select(active & (self.twosided | (si.wi.z > 0)), glow, 0)

        def sample_direction(self, it, sample, active=True):
            return dr.zeros(mi.DirectionSample3f), mi.Spectrum(0)

        def pdf_direction(self, it, ds, active=True):
            return mi.Float(0)

        def eval_direction(self, it, ds, active=True):
            return mi.Spectrum(0)

        def bbox(self):
            return self.get_shape().bbox()

        def traverse(self, callback):
            for name in ("k_i", "k_a", "ambient"):
                callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

        def to_string(self):
            return f"HeuristicGlow[k_i = {self.k_i}, k_a = {self.k_a}, ambient = {self.ambient}]"

    mi.register_emitter("heuristic_glow", HeuristicGlow)
