"""Values of the names in a scene's expressions: params, counters of repeats, and the time.

In a still scene an expression is a number. In a moving one, it is parsed once and evaluated for a
block of times together; then a number is looked up. Must not know objects or their keys.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np

from voxdisplay.compute.array_types import Floats
from voxdisplay.errors import CurveError
from voxdisplay.expressions.parse import constant, excerpt, parse
from voxdisplay.expressions.program import values_of_template

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from voxdisplay.expressions.partial_evaluation import PartialExpression
    from voxdisplay.expressions.program import Expression


class Environment(ABC):
    """Names that have values.

    Attributes
    ----------
    names : mapping of str to float
        Those whose values are the same at all times.

    """

    names: Mapping[str, float]

    @abstractmethod
    def number(self, source: str | float) -> float:
        """Return the value of an expression without variables; raise CurveError as `parse`."""

    @abstractmethod
    def formula(self, source: str | float, variables: tuple[str, ...]) -> Expression:
        """Return the expression of some variables; raise CurveError as `parse`."""

    @abstractmethod
    def nested(self, names: Mapping[str, float]) -> Environment:
        """Return an environment of more names, the same one for the same names and values."""

    @property
    def varies(self) -> bool:
        """True if values may depend on the time."""
        return False

    def table_of(self, rows: Sequence[Sequence[str | float]]) -> Floats | None:  # noqa: ARG002 - as above
        """Return rows of expressions that were computed together; None if they were not.

        The rows are those of the file, and are not changed.
        """
        return None


class StillEnvironment(Environment):
    """Environment of a scene without time.

    Parameters
    ----------
    names : mapping of str to float

    """

    def __init__(self, names: Mapping[str, float]) -> None:
        self.names = names

    def number(self, source: str | float) -> float:
        """Return a value: `Environment.number`."""
        return constant(source, self.names)

    def formula(self, source: str | float, variables: tuple[str, ...]) -> Expression:
        """Return an expression: `Environment.formula`."""
        return parse(source, self.names, variables=variables)

    def nested(self, names: Mapping[str, float]) -> StillEnvironment:
        """Return an environment of more names: `Environment.nested`."""
        return StillEnvironment({**self.names, **names})


class ValueTable:
    """Values at a block of times of all expressions that depend on the time.

    Expressions that differ in their numbers alone are evaluated together. A frame does not depend
    on which others there are: see `values_of_template`.

    Parameters
    ----------
    variables : tuple of str
        Names whose values depend on the time.
    values_at : callable
        Takes times, (n,) float64, and returns the values of the variables, (n,) each.

    Attributes
    ----------
    variables : tuple of str
    block : (n,) float64 array
        The times that were computed together; another object for other times.
    row : int
        Which of them is the present time.
    column : list of float
        The values of all slots at the present time.
    touched : bool
        Whether a value that depends on the time was asked for; whoever wants to know sets it to
        False before.

    """

    def __init__(
        self, variables: tuple[str, ...], values_at: Callable[[Floats], Sequence[Floats]]
    ) -> None:
        self.variables = variables
        self.column: list[float] = []
        self.touched = False
        self._values_at = values_at
        self._expressions: list[Expression] = []
        self.row = 0
        self.block: Floats = np.zeros(1)
        self._variable_values: Sequence[Floats] | None = None
        self._templates: dict[tuple[Any, ...], list[int]] = defaultdict(list)
        self._values: Floats = np.empty((0, 1))  # (slots, n), without the newest
        self._newest: list[Floats] = []  # (n,) each

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_variable_values": None, "_values": np.empty((0, 1)), "_newest": []}

    def slot(self, expression: Expression) -> int:
        """Return the index in `column` of a new expression of the variables."""
        slot = len(self._expressions)
        self._expressions.append(expression)
        self._templates[expression.variables, expression.template].append(slot)
        if self._variable_values is None:
            self.seek(self.block, self.row)
        else:
            values = expression.value(*self._variable_values)
            self._newest.append(values)
            self.column.append(float(values[self.row]))
        return slot

    def seek(self, block: Floats, row: int) -> None:
        """Make one of a block's times, (n,), the present one."""
        if self._variable_values is None or not np.array_equal(block, self.block):
            self.block = block
            self._variable_values = self._values_at(block)
            self._newest = []
            self._values = np.empty((len(self._expressions), len(block)))
            for slots in self._templates.values():
                some = [self._expressions[slot] for slot in slots]
                self._values[slots] = values_of_template(some, self._variable_values)
        self.row = row
        self.column = self._all_values()[:, row].tolist()

    def values_of(self, slots: list[int]) -> Floats:
        """Return the values of some slots at all times of the block, (n, slots)."""
        return np.ascontiguousarray(self._all_values()[slots].T)

    def _all_values(self) -> Floats:
        if self._newest:
            self._values = np.concatenate((self._values, self._newest))
            self._newest = []
        return self._values


class MovingEnvironment(Environment):
    """Environment of a moving scene at the present time of a table.

    Parameters
    ----------
    names : mapping of str to float
        Those whose values are the same at all times.
    table : ValueTable

    """

    def __init__(self, names: Mapping[str, float], table: ValueTable) -> None:
        self.names = names
        self.table = table
        self._numbers: dict[str | float, float | int] = {}  # an int is a slot
        self._formulas: dict[tuple[str | float, tuple[str, ...]], _Formula] = {}
        self._tables: dict[int, _Rows] = {}
        self._nested: dict[tuple[tuple[str, float], ...], MovingEnvironment] = {}

    @property
    def varies(self) -> bool:
        """True."""
        return True

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_tables": {}}  # which go by identity

    def number(self, source: str | float) -> float:
        """Return a value: `Environment.number`."""
        found = self._numbers.get(source)
        if found is None:
            found = self._numbers[source] = self._compiled(source)
        if type(found) is float:
            return found
        self.table.touched = True
        value = self.table.column[found]  # type: ignore[index]
        if not math.isfinite(value):
            raise CurveError(f"{excerpt(source)} is not finite: {value}")
        return value

    def _compiled(self, source: str | float) -> float | int:
        expression = parse(source, self.names, variables=self.table.variables)
        value = expression.constant
        return self.table.slot(expression) if value is None else value

    def formula(self, source: str | float, variables: tuple[str, ...]) -> Expression:
        """Return an expression: `Environment.formula`."""
        # Most scenes are still, and are read sooner without this.
        from voxdisplay.expressions.partial_evaluation import split  # noqa: PLC0415

        found = self._formulas.get((source, variables))
        if found is None:
            early = tuple(name for name in self.table.variables if name not in variables)
            expression = parse(source, self.names, variables=(*variables, *early))
            partial = split(expression, variables)
            found = _Formula(partial, [self.table.slot(part) for part in partial.parts])
            if not found.slots:
                found.bound = partial.bind([])
            self._formulas[source, variables] = found
        if found.bound is not None:
            return found.bound
        self.table.touched = True
        return found.partial.bind([self.table.column[slot] for slot in found.slots])

    def table_of(self, rows: Sequence[Sequence[str | float]]) -> Floats | None:
        """Return rows at the present time, (n, m): `Environment.table_of`.

        None at first and where a value is not finite: then `number` says which.
        """
        found = self._tables.get(id(rows))
        if found is None:
            self._tables[id(rows)] = _Rows(rows)
            return None
        return found.at_present(self.table, self._numbers)

    def nested(self, names: Mapping[str, float]) -> MovingEnvironment:
        """Return an environment of more names: `Environment.nested`."""
        key = tuple(names.items())
        if key not in self._nested:
            self._nested[key] = MovingEnvironment({**self.names, **names}, self.table)
        return self._nested[key]


class _Formula:
    """A formula, the slots of its open parts, and the whole if there are none."""

    def __init__(self, partial: PartialExpression, slots: list[int]) -> None:
        self.partial = partial
        self.slots = slots
        self.bound: Expression | None = None


class _Rows:
    """Rows of expressions, computed for all times of a block together."""

    def __init__(self, rows: Sequence[Sequence[str | float]]) -> None:
        self._rows = rows  # held, so that no other object gets its identity
        self._block: Floats | None = None
        self._values = np.empty((0, 0, 0))
        self._finite: list[bool] = []
        self._varies = False

    def at_present(
        self, table: ValueTable, numbers: Mapping[str | float, float | int]
    ) -> Floats | None:
        """Return the values at the present time; ``numbers`` knows all of the expressions."""
        if self._block is not table.block and not self._compute(table, numbers):
            return None
        if not self._finite[table.row]:
            return None
        table.touched |= self._varies
        return np.asarray(self._values[table.row])

    def _compute(self, table: ValueTable, numbers: Mapping[str | float, float | int]) -> bool:
        """Compute all values; return False if an expression was not read yet."""
        texts = [cell for row in self._rows for cell in row]
        if not all(isinstance(text, float) or text in numbers for text in texts):
            return False
        cells = [text if isinstance(text, float) else numbers[text] for text in texts]
        slots = [at for at, cell in enumerate(cells) if type(cell) is int]
        values = np.empty((len(table.block), len(cells)))
        values[:] = [0.0 if type(cell) is int else cell for cell in cells]
        if slots:
            values[:, slots] = table.values_of([int(cells[at]) for at in slots])
        self._varies = bool(slots)
        self._finite = [bool(np.isfinite(each).all()) for each in values]
        self._values = values.reshape(len(values), len(self._rows), -1)
        self._block = table.block
        return True
