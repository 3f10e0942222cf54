"""External accelerations of the rope nodes: the torch reference of `rope_force_kernels`, for `differentiable`."""

from collections.abc import Mapping
from functools import cached_property

import numpy as np
import torch

from hemline.animators.ropes.mechanics.balance import STANDARD_GRAVITY
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.animators.ropes.mechanics.rope_force_kernels import LATERAL_BOUND, REST_ANGLE_BOUND, SHRINK_BOUND

Tensor = torch.Tensor
_TINY = 1e-30
"""Added to squares before roots are taken, so that zero has a gradient; below rounding."""


def dot(one: Tensor, two: Tensor) -> Tensor:
    """Returns scalar products along the last axis."""
    return (one * two).sum(-1)


def length_of(vectors: Tensor) -> Tensor:
    """Returns lengths along the last axis."""
    return (dot(vectors, vectors) + _TINY).sqrt()


class TorchForces:
    """Chains as a table with one row for each chain, padded at the tips with fixed copies.

    Tables are (chains, nodes) or (windows, chains, nodes, ...).
    """

    def __init__(self, chains: RopeChains, parameters: Mapping[str, Tensor]):
        self.chains, self.parameters = chains, parameters
        counts = np.diff(chains.offsets)
        column = np.arange(counts.max())
        self.real = torch.as_tensor(column < counts[:, None])
        table = np.minimum(chains.offsets[:-1, None] + column, chains.offsets[1:, None] - 1)
        self.table = torch.as_tensor(table).long()
        self.free = self.real & torch.as_tensor(column > 0)
        place = np.zeros(int(chains.offsets[-1]), np.int64)
        place[table[self.real.numpy()]] = np.flatnonzero(self.real.numpy())
        self.pairs, across = place[chains.pairs], place[chains.across[table]]
        here = place[table]
        sides = (across != here[..., None]).all(-1) & self.free.numpy()
        self.sides = torch.as_tensor(here[sides]), torch.as_tensor(across[sides])
        self.across = torch.as_tensor(across)

    def of(self, name: str) -> Tensor:
        """Returns a parameter, or the value of the chains in its place."""
        if name in self.parameters:
            return self.parameters[name]
        owner = self.chains if hasattr(self.chains, name) else self.chains.constants
        return torch.as_tensor(np.asarray(getattr(owner, name), np.float64))

    @cached_property
    def inverse(self) -> Tensor:
        """1 / mass, 0 for roots and copies (chains, nodes) [1/kg]."""
        return self.free.double() / self.of("masses")[self.table]

    @cached_property
    def rest_loads(self) -> Tensor:
        """Load of each node in the drape, its weight and the tension of the rope below (chains, nodes) [N]."""
        tensions = self.of("rest_tensions")[self.table] * self.real
        return STANDARD_GRAVITY * self.of("masses")[self.table] + self._below(tensions)

    def _below(self, values: Tensor) -> Tensor:
        shifted = torch.cat([values[..., 1:], torch.zeros_like(values[..., :1])], dim=-1)
        return shifted * torch.cat([self.real[:, 1:], self.real[:, :1] & False], dim=-1)

    def _add_relative(self, accelerations: Tensor, relative: Tensor) -> Tensor:
        """Adds accelerations of nodes relative to those above (windows, chains, ropes, 3), divided by mass."""
        relative = relative * self.free[:, 1:, None]
        above, here = self.inverse[:, :-1], self.inverse[:, 1:]
        both = (above + here + (~self.free[:, 1:]).double())[..., None]
        none = torch.zeros_like(relative[:, :, :1])
        down, up = here[..., None] / both * relative, above[..., None] / both * relative
        return accelerations + torch.cat([none, down], dim=2) - torch.cat([up, none], dim=2)

    def springs(self, x: Tensor, tensions: Tensor, turns: Tensor, h: float) -> Tensor:
        """Returns gravity, balance and springs, independent of velocities (windows, chains, nodes, 3) [m/s^2]."""
        gravity = self.of("gravity")
        size = length_of(gravity)
        load = (size * self.of("masses")[self.table] + self._below(tensions)) / self.rest_loads
        ratio = torch.minimum(load, (size / STANDARD_GRAVITY).expand(load.shape)) * self.free
        balance = torch.einsum("wcij,cnj->wcni", turns, self.of("balance")[self.table])
        ratio = ratio * self._remaining_balance(x, turns, balance)
        result = self._add_relative(
            gravity + ratio[..., None] * balance, self._shrink_springs(x, h) + self._angle_springs(x, turns, h)
        )
        return self._add_lateral(result, x, h)

    def _remaining_balance(self, x: Tensor, turns: Tensor, balance: Tensor) -> Tensor:
        """Returns which fraction of its balance each node keeps (windows, chains, nodes)."""
        reach = self.of("balance_reach")
        if not float(reach):
            return torch.ones(())
        steps = self.of("rest_spans")[self.table][..., None] * self.of("rest_directions")[self.table]
        steps = torch.cat([torch.zeros_like(steps[:, :1]), steps[:, 1:]], dim=1)
        at_rest = x[:, :, :1] + torch.einsum("wcij,cnj->wcni", turns, steps.cumsum(dim=1))
        away = dot(x - at_rest, balance) / length_of(balance).clamp(min=1e-9)
        return torch.where(length_of(balance) < 1e-9, 1.0, (1 - away / reach).clamp(0, 1))

    def _shrink_springs(self, x: Tensor, h: float) -> Tensor:
        away = x[:, :, 1:] - x[:, :, :-1]
        span = length_of(away)
        missing = (self.of("rest_spans")[self.table][:, 1:] - span).clamp(min=0)
        return _saturate(self.of("shrink"), h, SHRINK_BOUND) * (missing / span)[..., None] * away

    def _angle_springs(self, x: Tensor, turns: Tensor, h: float) -> Tensor:
        """Returns springs towards the rest angles, in a frame carried from root to tip without twist."""
        rest, frame, relative = self.of("rest_directions")[self.table], turns, []
        for i in range(1, x.shape[2]):
            away = x[:, :, i] - x[:, :, i - 1]
            span = length_of(away)[..., None]
            target = torch.einsum("wcij,cj->wci", frame, rest[:, i])
            relative.append(torch.zeros_like(away) if i == 1 else span * target - away)
            direction = away / span
            axis, cosine = torch.linalg.cross(target, direction), dot(target, direction)[..., None, None]
            spun = torch.linalg.cross(axis[..., None].expand(frame.shape), frame, dim=-2)
            again = torch.linalg.cross(axis[..., None].expand(frame.shape), spun, dim=-2)
            turned = frame + spun + again / (1 + cosine.clamp(min=-0.99))
            frame = torch.where(cosine > -0.99, turned, frame)
        return _saturate(self.of("rest_angle"), h, REST_ANGLE_BOUND) * torch.stack(relative, dim=2)

    def _add_lateral(self, accelerations: Tensor, x: Tensor, h: float) -> Tensor:
        one, two = torch.as_tensor(self.pairs).T
        flat, inverse = x.flatten(1, 2), self.inverse.flatten()
        away = flat[:, two] - flat[:, one]
        span = length_of(away)
        soft = _saturate(self.of("lateral"), h, LATERAL_BOUND)
        both = _saturate(self.of("lateral") + self.of("lateral_stretch"), h, LATERAL_BOUND)
        rest, longest = self.of("pair_spans").T
        pull = soft * (rest - span) + (both - soft) * (longest - span).clamp(max=0)
        relative, total = (pull / span)[..., None] * away, inverse[one] + inverse[two]
        result = accelerations.flatten(1, 2).index_add(1, two, (inverse[two] / total)[:, None] * relative)
        result = result.index_add(1, one, -(inverse[one] / total)[:, None] * relative)
        return result.unflatten(1, x.shape[1:3])

    def external(self, springs: Tensor, x: Tensor, v: Tensor, h: float) -> Tensor:
        """Returns all accelerations of free nodes: springs, drag, damping and air [m/s^2]."""
        level = torch.arange(x.shape[2], dtype=torch.float64)
        damping = self.of("parent_damping") + self.of("root_damping") * torch.exp(1 - level)
        rates = self.of("drag") + damping
        ratio = torch.where(rates > 0, self.of("drag") / rates.clamp(min=_TINY), torch.zeros_like(rates))[:, None]
        above = torch.cat([v[:, :, :1], v[:, :, :-1]], dim=2)
        towards = ratio * self.of("wind") + (1 - ratio) * above - v
        rate = (-torch.expm1(-0.5 * h * rates) / (0.5 * h))[:, None]
        result = self._add_smoothing(springs + rate * towards, v, h)
        return result + self._air(x, v, h) * self.free[..., None]

    def _add_smoothing(self, accelerations: Tensor, v: Tensor, h: float) -> Tensor:
        inverse, flat = self.inverse.flatten(), v.flatten(1, 2)
        inner = torch.nonzero((self.free & torch.cat([self.free[:, 1:], self.free[:, :1] & False], 1)).flatten())[:, 0]
        result = accelerations.flatten(1, 2)
        for name, (here, beside) in (
            ("bend_damping", (inner, torch.stack([inner - 1, inner + 1], 1))),
            ("lateral_damping", self.sides),
        ):
            rate = self.of(name) / (1 + 4 * h * self.of(name))
            away = rate * (flat[:, here] - flat[:, beside].mean(2))
            result = result.index_add(1, here, -away)
            for side in beside.T:
                result = result.index_add(1, side, 0.5 * away * (inverse[side] / inverse[here])[:, None])
        return result.unflatten(1, v.shape[1:3])

    def _air(self, x: Tensor, v: Tensor, h: float) -> Tensor:
        flat = x.flatten(1, 2)
        below = torch.where(
            torch.cat([self.free[:, 1:], self.free[:, :1] & False], 1)[..., None], x.roll(-1, dims=2), x
        )
        across = flat[:, self.across[..., 1]] - flat[:, self.across[..., 0]]
        normal = torch.linalg.cross(below - x.roll(1, dims=2), across)
        size = length_of(normal)[..., None]
        faces = size > 1e-12
        normal, wind = normal / torch.where(faces, size, torch.ones_like(size)), self.of("wind") - v
        speed, facing = length_of(wind), dot(wind, normal)
        plain = facing.abs() * (self.of("air_drag") - self.of("air_lift") * facing.abs() / speed).clamp(min=0)
        lifted = self.of("air_lift") * speed
        bound = 1 + 0.5 * h * (plain + lifted)
        result = (plain[..., None] * wind + (lifted * facing)[..., None] * normal) / bound[..., None]
        return torch.where(faces & (speed > 1e-12)[..., None], result, torch.zeros_like(result))


def _saturate(constant: Tensor, h: float, bound: float) -> Tensor:
    return constant / (1 + constant * h * h / bound)
