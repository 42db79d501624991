"""Shapley values: the worth of each of several effects, whatever the order they are added in.

For players ``N`` and a value ``v(S)`` of each subset, the share of player ``i`` is ::

    phi_i = sum over S in N without i of  |S|! (n - |S| - 1)! / n!  [v(S + i) - v(S)]

its mean gain over all orders in which the players may come. The shares add up to
``v(N) - v(empty)``. Source: L. S. Shapley, *A value for n-person games*, 1953.
"""

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import Any, TypeVar

import numpy as np

Player = TypeVar("Player", bound=Hashable)

EXACT_PLAYERS = 6
"""Players up to which every subset is valued (64 of them); beyond, orders are drawn."""

ORDERS = 48
"""Orders drawn if there are too many subsets."""


@dataclass(frozen=True)
class Shares:
    """The share of each player, in the players' order.

    Attributes
    ----------
    values
        ``phi_i``: numbers or arrays, as the value function returns them.
    sampling_error
        Standard error of the means of ``values`` from drawing orders; 0 if exact.
    orders
        Orders drawn; 0 if exact.
    """

    values: tuple[Any, ...]
    sampling_error: tuple[float, ...]
    orders: int


def subsets(players: Sequence[Player]) -> list[frozenset[Player]]:
    """Return all subsets of the players, small ones first."""
    return [
        frozenset(chosen)
        for size in range(len(players) + 1)
        for chosen in combinations(players, size)
    ]


def shares(
    players: Iterable[Player],
    value: Callable[[frozenset[Player]], Any],
    seed: int = 0,
    exact_players: int = EXACT_PLAYERS,
    orders: int = ORDERS,
) -> Shares:
    """Return the shares of players in a game.

    Parameters
    ----------
    players
        Hashable names.
    value
        The number or array of a subset. It is called more than once per subset and should cache
        what is expensive.
    seed
        Of the orders drawn.
    exact_players
        Players up to which every subset is valued.
    orders
        Orders drawn if there are more: an even number, at least 4.
    """
    players = tuple(players)
    if len(players) <= exact_players:
        exact = tuple(_exact(player, players, value) for player in players)
        return Shares(exact, (0.0,) * len(players), 0)
    return _sampled(players, value, orders, np.random.default_rng(seed))


def _exact(player, players, value):
    others = [other for other in players if other != player]
    total = 0.0
    for subset in subsets(others):
        weight = 1 / (len(players) * comb(len(others), len(subset)))
        total = total + weight * (value(subset | {player}) - value(subset))
    return total


def _sampled(players, value, orders, rng):
    """Average over orders drawn in pairs, each followed by its reverse, which cancels noise."""
    gains = {player: [] for player in players}
    for _ in range(orders // 2):
        order = rng.permutation(len(players))
        for way in (order, order[::-1]):
            subset, before = frozenset(), value(frozenset())
            for place in way:
                subset = subset | {players[place]}
                after = value(subset)
                gains[players[place]].append(after - before)
                before = after
    values = tuple(sum(gains[player]) / orders for player in players)
    errors = tuple(_pair_error(gains[player]) for player in players)
    return Shares(values, errors, orders)


def _pair_error(gains):
    """Standard error of the mean, from pairs of an order and its reverse, which are independent."""
    means = np.array([np.mean(gain) for gain in gains]).reshape(-1, 2).mean(axis=1)
    return float(means.std(ddof=1) / np.sqrt(len(means)))
