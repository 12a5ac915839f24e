"""The order of Get and Set: variables of the scene, their declared dependencies, and plans by topological sorting.

A plan is a list of steps on whole groups of variables of one component, so that each component and pass costs one Set and
one Get. Where declared dependencies form a loop (raw connections), the variables of the loop become one step that the
host solves.
"""

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .definition import Connection, Ref
from .ports import pass_of


@dataclass(frozen=True)
class Put:
    """Set these inputs of one component."""

    component: str
    inputs: tuple[Ref, ...]


@dataclass(frozen=True)
class Take:
    """Get these outputs of one component."""

    component: str
    outputs: tuple[Ref, ...]


@dataclass(frozen=True)
class Solve:
    """Inputs that depend on each other through these outputs."""

    inputs: tuple[Ref, ...]
    outputs: tuple[Ref, ...]


Step = Put | Take | Solve


class Graph:
    """Connections, inputs that the host feeds, outputs that it wants, and what depends on what.

    `depends(output)`: all inputs that the output is declared to depend on.
    """

    def __init__(
        self,
        components: Iterable[str],
        connections: Iterable[Connection],
        feeds: Iterable[Ref],
        wanted: Iterable[Ref],
        depends: Callable[[Ref], Collection[Ref]],
    ):
        self.rank = {name: i for i, name in enumerate(components)}
        self.source = {connection.target: connection for connection in connections}
        self.feeds = set(feeds)
        self.inputs = set(self.source) | self.feeds
        self.outputs = {connection.source for connection in self.source.values()} | set(wanted)
        self.depends = {output: frozenset(self.inputs & set(depends(output))) for output in self.outputs}

    def affected(self, changed: Iterable[Ref]) -> tuple[set[Ref], set[Ref]]:
        """Inputs and outputs that change with these inputs, which are among them."""
        inputs, outputs = set(changed), set()
        while True:
            new = {o for o in self.outputs - outputs if self.depends[o] & inputs}
            if not new:
                return inputs, outputs
            outputs |= new
            inputs |= {i for i, connection in self.source.items() if connection.source in new}

    def needed(self, wanted: Iterable[Ref], inputs: set[Ref], outputs: set[Ref]) -> tuple[set[Ref], set[Ref]]:
        """Of these inputs and outputs those on the way to the wanted outputs."""
        need_outputs, need_inputs = set(), set()
        fresh = set(wanted) & outputs
        while fresh:
            need_outputs |= fresh
            new = {i for o in fresh for i in self.depends[o] & inputs} - need_inputs
            need_inputs |= new
            fresh = {self.source[i].source for i in new if i in self.source} & outputs - need_outputs
        return need_inputs, need_outputs

    def plan(self, inputs: Iterable[Ref], outputs: Iterable[Ref]) -> list[Step]:
        """Set all these inputs and get all these outputs, each after what it depends on."""
        return _Planner(self, set(inputs), set(outputs)).steps()


class _Planner:
    """Kahn's sorting over groups: motion before load before acceleration, leaders in the order of the scene."""

    def __init__(self, graph: Graph, inputs: set[Ref], outputs: set[Ref]):
        self.graph = graph
        self.unset, self.unread = inputs, outputs
        # a value is there if the host feeds it or its source is not part of this plan
        self.here = {i for i in inputs if i not in graph.source or graph.source[i].source not in outputs}

    def steps(self) -> list[Step]:
        steps: list[Step] = []
        while self.unread:
            ready = self._ready()
            steps += self._group(*ready) if ready else self._loop()
        for name in sorted({i[0] for i in self.unset}, key=self.graph.rank.get):
            steps.append(Put(name, self._take_in(name)))
        return steps

    def _ready(self) -> tuple[str, list[Ref]] | None:
        """The component that goes next and its outputs that can be read once its inputs are set."""
        waiting = self.unset - self.here
        groups: dict[str, list[Ref]] = {}
        for output in self.unread:
            if not self.graph.depends[output] & waiting:
                groups.setdefault(output[0], []).append(output)
        if not groups:
            return None
        first = lambda name: (min(pass_of(o[1]) for o in groups[name]), self._position(name, groups[name]))
        name = min(groups, key=first)
        return name, groups[name]

    def _position(self, name: str, outputs: list[Ref]) -> int:
        """Leaders first on the way out; on the way back the order follows from the dependencies alone."""
        rank = self.graph.rank[name]
        return -rank if min(pass_of(o[1]) for o in outputs) == 1 else rank

    def _group(self, name: str, outputs: list[Ref]) -> list[Step]:
        put = self._take_in(name)
        self._read(outputs)
        take = Take(name, tuple(sorted(outputs, key=_order)))
        return [Put(name, put), take] if put else [take]

    def _take_in(self, name: str) -> tuple[Ref, ...]:
        """Inputs of the component whose values are there; they count as set."""
        put = tuple(sorted((i for i in self.unset & self.here if i[0] == name), key=_order))
        self.unset -= set(put)
        return put

    def _read(self, outputs: Iterable[Ref]):
        outputs = set(outputs)
        self.unread -= outputs
        self.here |= {i for i in self.unset if i in self.graph.source and self.graph.source[i].source in outputs}

    def _loop(self) -> list[Step]:
        """The next strongly connected set of outputs, with the inputs that close it."""
        unread = sorted(self.unread)
        number = {output: k for k, output in enumerate(unread)}
        waiting = self.unset - self.here
        edges = [
            (number[self.graph.source[i].source], number[output])
            for output in unread
            for i in self.graph.depends[output] & waiting
        ]
        rows, columns = np.array(edges).T
        of = coo_array((np.ones(len(edges)), (rows, columns)), shape=(len(unread),) * 2)
        _, label = connected_components(of, connection="strong")
        fed = {label[b] for a, b in edges if label[a] != label[b]}
        loop = next(label[b] for _, b in edges if label[b] not in fed)
        outputs = [o for o in unread if label[number[o]] == loop]
        inputs = {i for o in outputs for i in self.graph.depends[o] & waiting}
        before = [Put(name, self._take_in(name)) for name in sorted({o[0] for o in outputs}, key=self.graph.rank.get)]
        self._read(outputs)
        self.unset -= inputs
        # what else the same outputs feed is set when its component goes
        key = lambda ref: (self.graph.rank[ref[0]], *_order(ref))
        return [put for put in before if put.inputs] + [
            Solve(tuple(sorted(inputs, key=key)), tuple(sorted(outputs, key=key)))
        ]


def _order(ref: Ref) -> tuple[int, str]:
    return pass_of(ref[1]), ref[1]
