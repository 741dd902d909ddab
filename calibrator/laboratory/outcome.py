"""Outcome of the verb `measure`: what each file gave, and the rows of the lab file."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Value:
    """A measured quantity of one repeat.

    error : one standard deviation of this reading, None where it is not known; unit : SI, angles in
    degrees; response : whether it is one of the contract and goes into the lab file.
    """

    value: float
    error: float | None
    unit: str
    response: bool = True


@dataclass(frozen=True)
class Reading:
    """What one repeat gave.

    source : file, and repeat within it; values by name; notes : how it was measured, in words;
    warnings : what to doubt; profile : positions and heights (k,) of the surface [m], or in pixels
    where nothing gave the scale; of a discharge, times since the release [s], where that is known,
    and masses [kg]; overlay : picture of what was found, "" where there is none.
    """

    source: str
    values: dict[str, Value]
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    profile: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    overlay: str = ""


@dataclass(frozen=True)
class Row:
    """A row of the lab file; scatter : of one repeat, None where it is not known.

    file : of a curve, whose name stands for the value.
    """

    setup: str
    condition: str
    response: str
    value: float
    scatter: float | None
    replicates: int
    unit: str
    role: str
    file: str = ""

    def cells(self, with_condition: bool) -> list[str]:
        """The cells as they stand in the file."""
        scatter = "" if self.scatter is None else f"{self.scatter:.4g}"
        condition = [self.condition] if with_condition else []
        value = self.file or f"{self.value:.7g}"
        last = [value, scatter, str(self.replicates), self.unit, self.role]
        return [self.setup, *condition, self.response, *last]


@dataclass(frozen=True)
class Measured:
    """Outcome of the verb `measure`.

    kind : of raw data; readings : one of each repeat; rows : of the lab file; converted : which
    units, in words; warnings : of all repeats together; lab : the file that the rows were written
    to, "" where they were only printed.
    """

    kind: str
    readings: tuple[Reading, ...]
    rows: tuple[Row, ...]
    converted: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    lab: str = ""
    notes: tuple[str, ...] = field(default=())

    def lines(self) -> list[str]:
        """The outcome in plain words."""
        count = len(self.readings)
        said = [f"{self.kind}, {count} {'repeat' if count == 1 else 'repeats'}"]
        for reading in self.readings:
            said.append(f"  {reading.source}:")
            said += [f"    {line}" for line in _table(reading.values)]
            said += [f"    {note}" for note in reading.notes]
            said += [f"    warning: {warning}" for warning in reading.warnings]
            if reading.overlay:
                said.append(f"    look at {reading.overlay}: is the outline on the surface?")
        said += [f"  converted: {words}" for words in self.converted]
        said += [f"  warning: {words}" for words in self.warnings]
        if not self.rows:
            return [*said, "  no set-up of the contract has these as responses: no row to write"]
        said.append(f"  rows written to {self.lab}:" if self.lab else "  rows of the lab file:")
        return [*said, *(f"    {line}" for line in self.csv())]

    def csv(self) -> list[str]:
        """Header and rows as they stand in a new lab file, without notes."""
        with_condition = any(row.condition for row in self.rows)
        names = ["setup", *(["condition"] if with_condition else []), "response", "value"]
        header = [*names, "scatter", "replicates", "unit", "role"]
        return [
            ",".join(cells) for cells in [header, *(r.cells(with_condition) for r in self.rows)]
        ]


def _table(values: dict[str, Value]) -> list[str]:
    """The values in columns of words."""
    widest = max(map(len, values), default=0)
    said = []
    for name, one in values.items():
        error = "" if one.error is None else f" +- {one.error:.2g}"
        unit = "" if one.unit == "1" else f" {one.unit}"
        said.append(f"{name:<{widest}}  {one.value:.5g}{error}{unit}")
    return said
