"""From rungs to renderers: which scene and integrator each method takes."""

from dataclasses import replace
from functools import cache

from comparisons.cost.ladder import DEPTHS, ladder, scope, shaded_by
from comparisons.cost.pairs import Pairs
from comparisons.effects.between import OF_BSDFS, Between
from heuristic.errors import InputError
from heuristic.heuristics import named
from heuristic.interpolation import Interpolation
from reference.pairing.halves import INTEGRATOR, with_sampler
from reference.planning.effects import Effect
from reference.rendering.renderer import Renderer, physical_integrator, variant


class Methods:
    """The ladder of a prepared comparison, and a renderer for each of its methods.

    Parameters
    ----------
    source, options
        As of :func:`comparisons.compare.compare`.
    ready : comparisons.compare.Prepared
        The scene, paired and planned.
    depths
        Depths of ``path`` that are rungs.
    """

    def __init__(self, source, options, ready, depths=DEPTHS):
        self.ready = ready
        self.heuristic_variant = options.heuristic_variant or ready.reference.variant

        self.pairs = Pairs(source, options, ready)
        self.between = Between(self.pairs.plain(), ready.plan, ready.scene)
        self.scope = scope(
            ready.plan, ready.pair, self.between.differences, self.between.has_occlusion
        )
        rungs = ladder(self.scope, self._interpolations(), depths)
        self.rungs = tuple(shaded_by(named(options.heuristic), rung) for rung in rungs)
        self._asked_for = options.interpolation
        self._kernel_scene = cache(self._make_kernel_scene)

    def renderer(self, method, spp):
        """Return a renderer of a method, with samples a pixel a pass."""
        if method.is_kernel:
            with variant(self.heuristic_variant):
                scene, integrator = self._kernel_scene(method.interpolation), self._kernel(method)
                return Renderer(scene, integrator, spp, "image of the kernel")
        scene = self._physical_scene(method.physical_bsdfs)
        integrator = physical_integrator(self._plan(method), scene, self.ready.pair.hide_emitters)
        return Renderer(scene, integrator, spp, "image of a rung")

    def forget(self):
        """Let go of the scenes of rungs."""
        self._kernel_scene.cache_clear()
        self.between.forget()

    def _make_kernel_scene(self, interpolation):
        if interpolation is self._asked_for:
            return self.ready.heuristic.scene
        graph = self.pairs.interpolated(interpolation).heuristic
        return with_sampler(graph, self.ready.plan.sampler).instantiate()

    def _kernel(self, method):
        """Return the integrator alone: a scene of its own would slow all others."""
        graph = self.pairs.interpolated(method.interpolation).heuristic.copy()
        graph.props(graph.nodes(INTEGRATOR)[0])["occlusion"] = method.occlusion
        return graph.instantiate().integrator()

    def _physical_scene(self, physical_bsdfs):
        if physical_bsdfs:
            return self.ready.scene
        return self.between.of(set(Effect) - OF_BSDFS)

    def _plan(self, method):
        """Return the plan of a method: its own depth, as the scene's plan has it for the rest."""
        plan = self.ready.plan
        if method.max_depth == self.scope.max_depth or not self.scope.interreflection:
            return plan
        if method.max_depth == 2:
            return replace(plan, integrator="direct_all", max_depth=2, shadows=self.scope.occlusion)
        return replace(plan, integrator="path", max_depth=method.max_depth)

    def _interpolations(self):
        """Return the interpolations that shapes and sensor allow: some make no meshes."""
        allowed = []
        for interpolation in Interpolation:
            try:
                with variant(self.heuristic_variant):
                    self.pairs.interpolated(interpolation)
            except InputError:
                if interpolation is Interpolation.PHONG:
                    raise
                continue
            allowed.append(interpolation)
        return tuple(allowed)
