"""Every kind of fault, in the order in which they strike."""

from tests.campaigns.faults import company, deaths, programs, records, surroundings
from tests.campaigns.faults.kind import Kind

KINDS: list[Kind] = [
    *deaths.KINDS,
    *records.KINDS,
    *surroundings.KINDS,
    *company.KINDS,
    *programs.KINDS,
]
