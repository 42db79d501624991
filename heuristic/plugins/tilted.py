"""The texture plugin ``heuristic_tilt``: the shading normal that a bump or normal map gives.

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


def define():
    """Create the class for the current variant and register it."""

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
