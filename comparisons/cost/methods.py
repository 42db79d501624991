"""From rungs to renderers: which scene and integrator each method takes."""

from dataclasses import replace
from functools import cache

from comparisons.cost.between import Between
from comparisons.cost.ladder import ladder, scope
from heuristic.errors import InputError
from heuristic.interpolation import Interpolation
from reference import halves
from reference.effects import Effect
from reference.halves import INTEGRATOR, with_sampler
from reference.rendering import Renderer, physical_integrator, variant


class Methods:
    """The ladder of a prepared comparison, and a renderer for each of its methods.

    Parameters
    ----------
    source, options
        As of :func:`comparisons.compare.compare`.
    ready : comparisons.compare.Prepared
        The scene, paired and planned.
    """

    def __init__(self, source, options, ready):
        self.ready = ready
        self.heuristic_variant = options.heuristic_variant or ready.reference.variant

        @cache
        def kernel_pair(interpolation):
            tessellation = options.tessellation
            return halves.pair(
                source,
                options.convention,
                options.resolution,
                interpolation,
                tessellation,
                prune=not options.everything,
            )

        self._kernel_pair = kernel_pair
        self.between = Between(_plain(source, options), ready.plan)
        self.scope = scope(
            ready.plan, ready.pair, self.between.differences, self.between.has_occlusion
        )
        self.rungs = ladder(self.scope, self._interpolations())
        self._scene = cache(self._make_scene)

    def renderer(self, method, spp):
        """Return a renderer of a method, with samples a pixel a pass."""
        if method.is_kernel:
            with variant(self.heuristic_variant):
                return Renderer(self._scene(method), None, spp, "image of the kernel")
        scene = self._scene(method)
        integrator = physical_integrator(self._plan(method), scene, self.ready.pair.hide_emitters)
        return Renderer(scene, integrator, spp, "image of a rung")

    def _make_scene(self, method):
        plan = self.ready.plan
        if method.is_kernel:
            graph = self._kernel_pair(method.interpolation).heuristic.copy()
            graph.props(graph.nodes(INTEGRATOR)[0])["occlusion"] = method.occlusion
            return with_sampler(graph, plan.sampler).instantiate()
        if method.physical_bsdfs:
            return self.ready.scene
        simulated = set(Effect) - {Effect.MICROFACETS, Effect.TRANSMISSION}
        return with_sampler(self.between.graph(simulated), plan.sampler).instantiate()

    def _plan(self, method):
        """Return the plan of a method: its own depth, as the scene's plan has it for the rest."""
        plan = self.ready.plan
        if method.max_depth == self.scope.max_depth or not self.scope.interreflection:
            return plan
        if method.max_depth == 2:
            return replace(plan, integrator="direct_all", max_depth=2, shadows=self.scope.occlusion)
        return replace(plan, integrator="path", max_depth=method.max_depth)

    def _interpolations(self):
        """Return the interpolations that the scene's shapes allow: some make no meshes."""
        allowed = []
        for interpolation in Interpolation:
            try:
                with variant(self.heuristic_variant):
                    self._kernel_pair(interpolation)
            except InputError:
                if interpolation is Interpolation.PHONG:
                    raise
                continue
            allowed.append(interpolation)
        return tuple(allowed)


def _plain(source, options):
    """Return the pair with its own geometry, that is without tessellation."""
    return halves.pair(source, options.convention, options.resolution)
