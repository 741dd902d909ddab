"""Verdicts on measurements of a made-up world in which the truth is known."""

import dataclasses

import numpy as np
import pytest

from calibrator.diagnosis.explanations import explain
from calibrator.diagnosis.rule import Rule
from calibrator.diagnosis.verdict import judge, withstands
from tests.toy_world import COUNT, EFFECTS, World

ALL = np.arange(COUNT)
HIDDEN = (1.5, 0, 0, 0)


def judged(world, surfaces, seed, kept=ALL, held=(), off=0.0, **hidden):
    """off : scatters of a replicate by which the held-out measurements are wrong."""
    rng = np.random.default_rng(seed)
    measured = world.measure(surfaces, rng, **hidden)
    measured.values[list(held)] += off
    return judge(surfaces, measured, EFFECTS, kept, rng, held=held)


def test_where_nothing_is_hidden_the_verdict_is_no_gap(world, surfaces):
    kinds = [judged(world, surfaces, seed).kind for seed in range(20)]
    assert kinds.count("no gap") >= 18


@pytest.mark.parametrize("beyond", [(-0.35, 0.5), (1.35, 0.5), (0.5, -0.3), (1.3, 1.3)])
def test_a_truth_outside_the_box_is_neither_no_gap_nor_an_effect(world, surfaces, beyond):
    verdicts = [judged(world, surfaces, seed, unit=beyond) for seed in range(6)]
    assert {v.kind for v in verdicts} == {"out of bounds"}
    out = {i: share > 1 for i, share in enumerate(beyond) if not 0 <= share <= 1}
    for v in verdicts:
        assert v.fits.p < 0.01 <= v.fits.p_wider
        assert {b.parameter: b.upper for b in v.fits.bounds}.items() & out.items()
        for i, upper in out.items():
            assert (v.fits.wider.unit[i] > 1) if upper else (v.fits.wider.unit[i] < 0)


@pytest.mark.parametrize("corner", [(0.0, 0.5), (1.0, 1.0), (0.01, 0.99)])
def test_a_truth_at_the_edge_of_the_box_is_no_gap_and_the_edge_is_said(world, surfaces, corner):
    verdicts = [judged(world, surfaces, seed, unit=corner) for seed in range(12)]
    assert [v.kind for v in verdicts].count("no gap") >= 11
    assert any(v.fits.bounds for v in verdicts)


def test_an_effect_is_still_named_where_parameters_stand_at_a_bound(world, surfaces):
    verdicts = [
        judged(world, surfaces, seed, unit=(0.0, 0.5), sizes=(0, 2.0, 0, 0)) for seed in range(6)
    ]
    assert [v.kind for v in verdicts].count("named") >= 4
    assert {v.effects for v in verdicts if v.kind == "named"} == {("drag",)}


@pytest.mark.parametrize("hidden", range(len(EFFECTS)))
def test_a_strong_effect_is_named_with_its_amplitude(world, surfaces, hidden):
    sizes = np.zeros(len(EFFECTS))
    sizes[hidden] = 1.5
    verdicts = [judged(world, surfaces, seed, sizes=sizes) for seed in range(4)]
    right = [v for v in verdicts if v.kind == "named"]
    assert len(right) >= 3 and {v.effects for v in right} == {(EFFECTS[hidden].name,)}
    for v in right:
        assert abs(v.best.amplitude[hidden] - 1.5) < 4 * v.best.amplitude_error[hidden]


def test_an_effect_outside_the_library_is_not_given_a_name_of_the_library(world, surfaces):
    verdicts = [judged(world, surfaces, seed, outside=1.0) for seed in range(8)]
    assert "named" not in {v.kind for v in verdicts} and "no gap" not in {v.kind for v in verdicts}


def test_a_name_is_taken_back_where_it_does_not_predict_what_was_held_out(world, surfaces):
    used, held, hidden = np.arange(COUNT - 3), np.arange(COUNT - 3, COUNT), (1.5, 0, 0, 0)
    good = [judged(world, surfaces, seed, used, held, sizes=hidden) for seed in range(8)]
    assert [v.kind for v in good].count("named") >= 7
    for seed, before in enumerate(good):
        after = judged(world, surfaces, seed, used, held, off=5.0, sizes=hidden)
        if before.kind == "named":
            assert before.held_out >= 0.02 > after.held_out
            assert (after.kind, after.effects, after.best) == (
                "ambiguous",
                ("adhesion", "unknown"),
                None,
            )


def test_held_out_data_are_as_probable_as_they_should_be_under_the_truth(world):
    """Or rather more: what the surfaces may miss is counted as an error whether they do or not."""
    used, held, p = np.arange(COUNT - 4), np.arange(COUNT - 4, COUNT), []
    for seed in range(40):
        surfaces = world.surfaces(np.random.default_rng(100 + seed))
        everything = world.measure(surfaces, np.random.default_rng(seed), sizes=(1.5, 0, 0, 0))
        fit = explain(surfaces, everything.only(used), EFFECTS, (0,), used)
        p.append(withstands(surfaces, everything, EFFECTS, fit, used, held))
    assert np.median(p) > 0.4 and np.quantile(p, 0.1) < 0.6 and np.mean(np.array(p) < 0.02) < 0.08


def test_two_effects_at_once_are_told_from_one(world, surfaces):
    verdicts = [judged(world, surfaces, seed, sizes=(1.5, 0, -1.5, 0)) for seed in range(6)]
    two = [v for v in verdicts if v.kind == "two effects"]
    assert len(two) >= 3 and {v.effects for v in two} == {("adhesion", "tilt")}
    assert "named" not in {v.kind for v in verdicts}
    seed = next(seed for seed, v in enumerate(verdicts) if v.kind == "two effects")
    rng = np.random.default_rng(seed)
    control = [dataclasses.replace(e, control=e.name == "tilt") for e in EFFECTS]
    assert (
        judge(
            surfaces, world.measure(surfaces, rng, sizes=(1.5, 0, -1.5, 0)), control, ALL, rng
        ).kind
        == "unknown"
    )


def test_with_few_observables_it_cannot_tell(world, surfaces):
    verdict = judged(world, surfaces, 1, kept=np.arange(6), sizes=(1.5, 0, 0, 0))
    assert verdict.kind == "cannot tell"


def test_effects_that_look_the_same_are_left_ambiguous(world):
    twins = World(3)
    twins.effects[1] = 1.02 * twins.effects[0]
    surfaces = twins.surfaces(np.random.default_rng(5))
    verdicts = [judged(twins, surfaces, seed, sizes=(1.5, 0, 0, 0)) for seed in range(4)]
    ambiguous = [v for v in verdicts if v.kind == "ambiguous"]
    assert len(ambiguous) >= 3
    assert all({"adhesion", "drag"} <= set(v.effects) for v in ambiguous)


def test_a_fixed_value_that_would_do_as_well_takes_a_name_back(world):
    twins = World(3)
    twins.effects[3] = 1.02 * twins.effects[0]
    surfaces = twins.surfaces(np.random.default_rng(5))
    effects, restitution = EFFECTS[:3], EFFECTS[3:]

    def said(own, seen):
        return [
            judge(seen, measured, effects, ALL, np.random.default_rng(1), uncertain=restitution)
            for measured in (
                own.measure(seen, np.random.default_rng(s), sizes=HIDDEN) for s in (1, 2)
            )
        ]

    for verdict in said(twins, surfaces):
        assert (verdict.kind, verdict.effects) == ("ambiguous", ("adhesion", "a fixed value"))
        assert verdict.best is None and verdict.fixed.effects == ("wall",)
        assert abs(verdict.fixed.amplitude[3] - 1.5) < 4 * verdict.fixed.amplitude_error[3]
    # where it looks otherwise, it is none
    for verdict in said(world, world.surfaces(np.random.default_rng(5))):
        assert (verdict.kind, verdict.effects) == ("named", ("adhesion",))


def test_a_name_needs_a_better_fit_than_an_explanation_does(world, surfaces):
    rng = np.random.default_rng(2)
    measured = world.measure(surfaces, rng, sizes=HIDDEN)
    named = judge(surfaces, measured, EFFECTS, ALL, rng)
    p = named.best.adequacy(surfaces.degrees)
    rule = Rule(adequacy=p / 4, fit=min(1.01 * p, 1.0))
    assert named.kind == "named" and p > Rule().fit
    verdict = judge(surfaces, measured, EFFECTS, ALL, rng, rule)
    assert (verdict.kind, verdict.effects) == ("ambiguous", ("adhesion", "unknown"))


@pytest.mark.parametrize("rule", [Rule(), Rule(reach=0.8)])
def test_a_control_and_an_amplitude_beyond_what_was_run_are_not_named(world, surfaces, rule):
    rng = np.random.default_rng(2)
    measured = world.measure(surfaces, rng, sizes=(1.5, 0, 0, 0))
    assert judge(surfaces, measured, EFFECTS, ALL, rng).kind == "named"
    control = rule == Rule()
    effects = [dataclasses.replace(e, control=control and e.name == "adhesion") for e in EFFECTS]
    verdict = judge(surfaces, measured, effects, ALL, rng, rule)
    assert (verdict.kind, verdict.effects) == ("ambiguous", ("adhesion", "unknown"))


def test_a_stricter_rule_names_less(world, surfaces):
    rng = np.random.default_rng(2)
    measured = world.measure(surfaces, rng, sizes=(0.6, 0, 0, 0))
    assert judge(surfaces, measured, EFFECTS, ALL, rng, Rule(lead=1e9)).kind != "named"


def test_an_effect_that_shows_nowhere_neither_wins_nor_breaks_the_verdict(world):
    blind = World(3)
    blind.effects[1] = 0
    surfaces = blind.surfaces(np.random.default_rng(4))
    # not even noise: no run of any experiment knows the effect
    for one in (*surfaces.plain, *surfaces.changes):
        one.coefficients[10:14] = 0
    verdict = judged(blind, surfaces, 1, sizes=(1.5, 0, 0, 0))
    assert verdict.effects == ("adhesion",)
    assert np.isfinite(list(verdict.posterior.values())).all()
    assert verdict.rivals.single[1].amplitude_error[1] == np.inf
