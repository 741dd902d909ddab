"""Judgement of a trial: the true responses are known, so what was said is right or wrong."""

from __future__ import annotations

from typing import Any

import numpy as np

from calibrator.case.problem import Target
from calibrator.responses.targets import bands
from tests.campaigns.answers.trial import Trial

CLEARLY = 2.0  # bands: what misses by more is clearly missed, or clearly out of reach
SAMPLE = 20_000


def judged(done: Trial) -> dict[str, Any]:
    """What was right and what was wrong, one plain dictionary for each trial."""
    out: dict[str, Any] = {
        "seed": done.seed,
        "kind": done.lab.kind,
        "parameters": len(done.made_up.parameters),
        "targets": len(done.lab.targets),
        "design": done.case.plan.design if done.case else "",
        "traceback": done.broke,
        "ended": _ended(done),
        "refusal": done.calls[-1].said.strip()[:300] if done.calls[-1:] and
        done.calls[-1].status == 2 else "",
        "stale": _stale(done),
        "status_against_words": _against_words(done),
        "contradictions": _contradictions(done),
        "over_ceiling": _over_ceiling(done),
    }  # fmt: skip
    calibration = done.summary.get("calibrate")
    if done.broke or calibration is None or done.case is None:
        return out
    out.update(_reach(done, calibration))
    out["intervals"] = _intervals(done, calibration)
    verdict = done.summary.get("verify")
    if verdict is not None:
        out.update(_passed(done, calibration, verdict))
    return out


def _ended(done: Trial) -> str:
    if done.broke:
        return "traceback"
    if done.edited:
        return "edited"
    last = done.calls[-1]
    return f"{last.verb} refused" if last.status == 2 else last.verb


def _stale(done: Trial) -> str:
    """What an edit left standing: the page of an answer that no longer holds."""
    if done.edited is None:
        return ""
    verb, what, after = done.edited
    if done.mixed:
        return f"{what} after {verb}: the database holds runs of before"
    if after.status == 2 and "calibrator" in after.said:
        return ""
    return f"{what} after {verb}: the report ended with {after.status}"


def _against_words(done: Trial) -> list[str]:
    """Verbs whose exit status is not what they say."""
    wrong = []
    for call in done.calls:
        refused = "calibrator: " in call.said
        if (call.status == 2) != refused:
            wrong.append(f"{call.verb} ended with {call.status}, and said {call.said[-200:]}")
        if call.verb == "verify" and call.status != 2:
            passed = "compromise: passed" in call.told
            if passed == ("compromise: NOT passed" in call.told) or (call.status == 0) != passed:
                wrong.append(f"verify ended with {call.status}")
        if call.verb == "run" and call.status == 0:
            statuses = done.summary.get("run", {}).get("statuses", {})
            if not statuses.get("ok"):
                wrong.append(f"run ended with 0, and its runs with {statuses}")
        if call.verb == "validate" and not any(r.role == "held_out" for r in done.lab.rows):
            wrong += ["validate: NOT passed, of nothing"] * ("NOT passed" in call.told)
    return wrong


def _contradictions(done: Trial) -> list[str]:
    """Sentences that cannot stand beside each other."""
    wrong = []
    verify = done.call("verify")
    passed = verify is not None and verify.status == 0
    if done.page and ">Use <b>" in done.page and not passed:
        wrong.append("use, though not verified")
    if done.page and "Verified:" in done.page.replace("Not verified:", "") and not passed:
        wrong.append("verified, though it is not")
    calibrate = done.call("calibrate")
    if calibrate is not None and "nan" in calibrate.told.lower().replace("resonan", ""):
        wrong.append("nan in words")
    return wrong


def _over_ceiling(done: Trial) -> bool:
    """Whether an adaptive design made more runs than it may."""
    if done.case is None or done.case.plan.design != "adaptive" or done.call("run") is None:
        return False
    fresh = sum(
        sum(v["statuses"].values())
        for v in done.summary.get("verify", {}).get("candidates", {}).values()
    ) + sum(done.summary.get("validate", {}).get("statuses", {}).values())
    return done.made - fresh > done.case.plan.most_runs


# Reach


def _misfits(done: Trial, targets: list[Target], shares: np.ndarray) -> np.ndarray:
    """Largest miss (n,) of any target, in bands without seed noise."""
    band = bands(targets, np.zeros(len(targets)), 1)
    return np.asarray(
        np.max([np.abs(_true(done, t, shares) - t.value) / b
                for t, b in zip(targets, band, strict=True)], axis=0)
    )  # fmt: skip


def _true(done: Trial, target: Target, shares: np.ndarray) -> np.ndarray:
    """True responses (n,) of a target."""
    if target.response == "residual_mass":
        return 0.016 * done.made_up.true(f"{target.setup}.residual_fraction", shares)
    return done.made_up.true(target.key, shares)


def closest(done: Trial, lucky: bool) -> float:
    """Smallest largest miss in the box, where runs succeed and constraints hold, in bands.

    lucky : where only some runs fail counts as well.
    """
    targets, made_up = done.lab.targets, done.made_up
    rng, count = np.random.default_rng(done.seed), len(made_up.truth)
    setups = {t.setup for t in targets}

    def loss(shares: np.ndarray) -> np.ndarray:
        feasible = made_up.feasible(shares, setups, lucky)
        return np.where(feasible, _misfits(done, targets, shares), np.inf)

    sample = np.concatenate([rng.random((SAMPLE, count)), made_up.truth[None]])
    first = loss(sample)
    best = np.inf
    for start in sample[np.argsort(first)[:6]]:
        half, point = 0.25, start
        for _ in range(14):
            near = np.clip(point + half * rng.uniform(-1, 1, (300, count)), 0, 1)
            near = np.concatenate([point[None], near])
            point, half = near[np.argmin(loss(near))], half * 0.6
        best = min(best, float(loss(point[None])[0]))
    return best


def _reach(done: Trial, calibration: dict[str, Any]) -> dict[str, Any]:
    miss, least, said = closest(done, False), closest(done, True), calibration["reachability"]
    return {
        "closest": min(miss, 1e9),
        "truly_reachable": True if miss <= 1 else False if least > CLEARLY else None,
        "called_reachable": said["all"],
    }


# Passed, and intervals


def _passed(done: Trial, calibration: dict[str, Any], verdict: dict[str, Any]) -> dict[str, Any]:
    """Whether the true responses at the compromise agree with its verdict."""
    assert done.case is not None
    parameters = calibration["candidates"]["compromise"]["parameters"]
    targets, runs = done.case.problem.targets, done.case.verify.replicates
    worst = 0.0
    for t in targets:
        shares = done.made_up.shares(parameters, t.setup)
        source = t.key.replace("residual_mass", "residual_fraction")
        factor = 0.016 if source != t.key else 1.0
        noise = factor * done.made_up.sigma(source, shares)
        band = float(bands([t], noise, runs)[0])
        if t.weight:
            worst = max(worst, abs(float(_true(done, t, shares)[0]) - t.value) / band)
    own = verdict["candidates"]["compromise"]["responses"]
    undecided = not verdict["passed"] and any(r["undecided"] for r in own)
    return {
        "passed": verdict["passed"],
        "worst_miss": worst,
        "wrong_passed": bool(verdict["passed"] and worst > CLEARLY),
        "wrong_missed": bool(not verdict["passed"] and not undecided and worst < 0.5),
        "cannot_tell": undecided,
    }


def _intervals(done: Trial, calibration: dict[str, Any]) -> list[dict[str, Any]]:
    """The 95 % intervals of a laboratory that measured a parameter set of the box."""
    if done.lab.kind != "consistent":
        return []
    if not done.made_up.feasible(done.made_up.truth[None], {t.setup for t in done.lab.targets})[0]:
        return []  # no run can be made at the truth
    found = []
    for q, share in zip(done.made_up.parameters, done.made_up.truth, strict=True):
        own = next(p for p in calibration["identifiability"]["parameters"] if p["name"] == q.name)
        if own.get("interval_95") is None:
            continue
        low, high = own["interval_95"]
        truth = float(q.values_at(np.array(share)))
        inside = low > q.low * (1 + 1e-9) and high < q.high * (1 - 1e-9)
        found.append(
            {"name": q.name, "inside_box": inside, "holds": low <= truth <= high,
             "share": float(q.shares_of(np.array(high)) - q.shares_of(np.array(low)))}
        )  # fmt: skip
    return found
