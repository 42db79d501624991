"""Make renderers from rungs: the scene and integrator of each method."""

from functools import cache

import mitsuba as mi

from comparisons.compare import Prepared
from comparisons.cost.ladder import ladder, scope, shaded_by, why_not
from comparisons.cost.pairs import Pairs
from comparisons.cost.rungs import DEPTHS, Kernel, Physical, rungs
from comparisons.effects.between import Between
from comparisons.options import Options
from heuristic.errors import InputError
from heuristic.heuristics import named
from heuristic.interpolation import Interpolation
from reference.effects import EFFECTS
from reference.pairing.halves import INTEGRATOR
from reference.rendering.renderer import Renderer, physical_integrator, variant
from reference.scene.sampler import with_sampler
from reference.scene.source import Source


class Methods:
    """The ladder of a prepared comparison, and a renderer for each of its methods.

    Parameters
    ----------
    source, options
        See :func:`comparisons.compare.compare`.
    ready
        The scene, paired and planned.
    depths
        Depths of ``path`` that are rungs.
    stand_ins
        Whether heuristics in place of transport are rungs.

    Attributes
    ----------
    rungs
        The ladder.
    left_out
        ``{name: why}`` of the rungs that the scene cannot have.
    """

    def __init__(
        self,
        source: Source,
        options: Options,
        ready: Prepared,
        depths: tuple[int, ...] = DEPTHS,
        stand_ins: bool = True,
    ):
        self.ready, self._stand_ins = ready, stand_ins
        self.viewing = options.viewing
        self.heuristic_variant = options.heuristic_variant or ready.reference.variant

        self.pairs = Pairs(source, options, ready)
        self.between = Between(self.pairs.plain(), ready.plan, ready.scene)
        self.scope = scope(
            ready.plan,
            self.between.differences,
            self.between.facts.has_shadows,
            ready.heuristic.scene.environment() is not None,
        )
        refusals = self._refused_interpolations() | self._refused_heuristics()
        found = ladder(self.scope, refusals, depths)
        self.rungs = tuple(shaded_by(named(options.heuristic), rung) for rung in found)
        reasons = {rung.name: why_not(rung, self.scope, refusals) for rung in rungs(depths)}
        self.left_out = {name: reason for name, reason in reasons.items() if reason}
        self._asked_for = options.interpolation
        self._kernel_scene = cache(self._make_kernel_scene)

    def renderer(
        self, method: Kernel | Physical, spp: int, size: tuple[int, int] | None = None
    ) -> Renderer:
        """Return a renderer of a method, with samples per pixel of a pass, and an image size."""
        if isinstance(method, Kernel):
            with variant(self.heuristic_variant):
                scene, integrator = self._kernel_scene(method.interpolation), self._kernel(method)
                return Renderer(scene, integrator, spp, "image of the kernel", size)
        simulated = set(EFFECTS) - method.without
        plan = self.ready.plan.simulating(simulated, method.max_depth)
        scene = self.between.of(simulated)
        integrator = physical_integrator(plan, scene, self.ready.pair.hide_emitters)
        return Renderer(scene, integrator, spp, "image of a rung", size)

    def forget(self) -> None:
        """Release the scenes of rungs."""
        self._kernel_scene.cache_clear()
        self.between.forget()

    def _make_kernel_scene(self, interpolation: Interpolation) -> mi.Scene:
        if interpolation is self._asked_for:
            return self.ready.heuristic.scene
        graph = self.pairs.interpolated(interpolation).heuristic
        return with_sampler(graph, self.ready.plan.sampler).instantiate()

    def _kernel(self, method: Kernel) -> mi.Integrator:
        """Return only the integrator: another scene would slow all others."""
        graph = self.pairs.interpolated(method.interpolation).heuristic.copy()
        props = graph.props(graph.nodes(INTEGRATOR)[0])
        props["occlusion"] = method.shadows
        if method.heuristic:
            props["model"] = method.heuristic
        return graph.instantiate().integrator()

    def _refused_interpolations(self) -> dict[str, str]:
        """Return why shapes or sensor do not allow interpolations: some cannot be meshes."""
        refused = {}
        for interpolation in Interpolation:
            try:
                with variant(self.heuristic_variant):
                    self.pairs.interpolated(interpolation)
            except InputError as error:
                if interpolation is Interpolation.PHONG:
                    raise
                refused[interpolation.value] = str(error)
        return refused

    def _refused_heuristics(self) -> dict[str, str]:
        """Return why the scene does not allow the heuristics of rungs that have their own."""
        refused = {}
        with variant(self.heuristic_variant):
            for rung in rungs():
                name = getattr(rung.method, "heuristic", "")
                if name and not self._stand_ins:
                    refused[name] = "A quick report does not measure it."
                    continue
                refuse = named(name).refuse if name else None
                refused[name] = refuse(self.ready.heuristic.scene) if refuse else ""
        return refused
