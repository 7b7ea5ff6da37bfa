"""Slow, obvious twin of the factor graph's messages: one number at a time."""

from __future__ import annotations

import math


def fix(azimuths, variances, places, iterations, start_variance):
    """FG-GE of one set of bearings, by sensor; None where a sensor has none. Mean and variance of x and of y."""
    there = [i for i, azimuth in enumerate(azimuths) if azimuth is not None]
    centre = [sum(place[axis] for place in places) / len(places) for axis in (0, 1)]
    heard = {i: {"x": (centre[0], start_variance), "y": (centre[1], start_variance)} for i in there}
    said = {}
    for _ in range(iterations):
        for i in there:
            phi, v, (X, Y) = math.pi / 2 - azimuths[i], variances[i], places[i]
            t, c = math.tan(phi), 1 / math.tan(phi)
            Vt, Vc = v / math.cos(phi) ** 4, v / math.sin(phi) ** 4
            (mx, vx), (my, vy) = heard[i]["x"], heard[i]["y"]
            said[i] = {
                "y": (Y - t * (X - mx), (X - mx) ** 2 * Vt + t**2 * vx + vx * Vt),
                "x": (X - c * (Y - my), (Y - my) ** 2 * Vc + c**2 * vy + vy * Vc),
            }
        heard = {i: {axis: product([said[k][axis] for k in there if k != i]) for axis in "xy"} for i in there}
    return product([said[i]["x"] for i in there]), product([said[i]["y"] for i in there])


def product(messages):
    weight = sum(1 / variance for _, variance in messages)
    return sum(mean / variance for mean, variance in messages) / weight, 1 / weight


def track(fixes, *, smooth, accelerates, alpha, noise, start):
    """FG-EKF or FG-EKS on one axis: (mean, variance) of each fix in, of each step out."""
    (s, Vs), (j, Vj) = fixes[:2]
    v, Vv, a, Va = j - s, Vj + Vs, 0.0, start
    out = [fixes[0]]
    for fix_ in fixes[1:]:
        n, Vn = product([(alpha * s + v, alpha**2 * Vs + Vv + noise**2), fix_])
        back, Vb = s, Vs
        if smooth:
            back, Vb = product([(n - v, Vn + Vv + noise**2), (s, Vs)])
            n, Vn = product([(alpha * back + v, alpha**2 * Vb + Vv + noise**2), fix_])
        ahead = (v + a, Vv + Va) if accelerates else (v, Vv)
        v_new, Vv_new = product([(n - back, Vn + Vb), ahead])
        a, Va = product([(a, Va), (v_new - v, Vv_new + Vv)])
        s, Vs, v, Vv = n, Vn, v_new, Vv_new
        out.append((s, Vs))
    return out
