"""What full and cheap runs say of a response, as a value; it computes nothing, like `parts`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TwoKinds:
    """What full and cheap runs say of one response.

    Attributes
    ----------
    key : experiment.response; full, cheap : runs that measured it.
    slope : of the full response over the cheap one; 0 where the cheap runs mislead, and are not
        leant on. discrepancy : how far from that line the full response strays, in its unit.
    difference : mean of full less cheap response at the sets that were run both ways.
    error_with, error_without : root mean square error at full sets left out, with the cheap runs
        and without; None where too few are left to say.
    cost : of a cheap run as a share of a full one's, predicted.
    """

    key: str
    full: int
    cheap: int
    slope: float
    discrepancy: float
    difference: float | None
    error_with: float | None
    error_without: float | None
    cost: float

    @property
    def misleads(self) -> bool:
        """Whether the cheap runs were not leant on."""
        return self.slope == 0

    @property
    def sentence(self) -> str:
        """That in plain words."""
        said = f"{self.key}: {self.full} full and {self.cheap} cheap runs"
        if self.misleads:
            return (
                f"{said}; the cheap ones mislead, as the full ones do not follow them, and are not"
                " used: run more sets in full (fidelity.dear_sets), or choose a cheaper version"
                " that behaves alike"
            )
        said += f"; the full ones follow {self.slope:.2f} times the cheap ones within"
        said += f" {self.discrepancy:.2g}"
        if self.error_with is not None:
            without = "" if self.error_without is None else f", {self.error_without:.2g} without"
            said += f"; error at full sets left out {self.error_with:.2g} with the cheap runs"
            said += without
        return said
