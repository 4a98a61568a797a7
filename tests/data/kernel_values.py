#!/usr/bin/env python3
"""Values and derivatives of kernels to 60 digits at exact binary points; writes kernel_values.json beside this file.

Every kernel is a polynomial P with rational coefficients times pi^(-D/2) a^(D/2) exp(-a |z|^2) or a polynomial of its
own; P and its derivatives are formed in rational arithmetic, and only the last sum is rounded. Polynomials of the
exchange kernels are read from pse_kernels.json beside this file, all others derived here.

An entry is [value, remainder, size]: value + remainder is exact to about 1e-4 of the last place of value, and size is the
sum of the absolute terms of the formula (given below with each kernel), the unit of an error being eps * size.
Derivatives are given at every other point. Needs mpmath.
"""
import json, os, random
from fractions import Fraction as F
from itertools import product
from math import comb, factorial
from mpmath import mp, mpf, exp, pi

mp.dps = 60
HERE = os.path.dirname(os.path.abspath(__file__))


# Polynomials: {exponents: coefficient}.

def times(p, q):
    out = {}
    for a, x in p.items():
        for b, y in q.items():
            key = tuple(i + j for i, j in zip(a, b))
            out[key] = out.get(key, 0) + x * y
    return out


def evaluate(p, z):
    total = mpf(0)
    for alpha, c in p.items():
        term = mpf(c.numerator) / c.denominator
        for x, n in zip(z, alpha):
            term *= x ** n
        total += term
    return total


def absolute(p):
    return {alpha: abs(c) for alpha, c in p.items()}


def square(dim):
    return {tuple(2 * (i == axis) for i in range(dim)): F(1) for axis in range(dim)}


def radial(coefficients, dim):
    """sum_k c_k |z|^2k"""
    out, power = {}, {(0,) * dim: F(1)}
    for c in coefficients:
        for alpha, x in power.items():
            out[alpha] = out.get(alpha, 0) + c * x
        power = times(power, square(dim))
    return out


def multi_indices(dim, degrees):
    return [beta for n in degrees for beta in product(range(n + 1), repeat=dim) if sum(beta) == n]


# Entries.

def entry(value, size):
    head = float(value)
    return [head, float(mp.nstr(value - mpf(head), 5)), float(mp.nstr(size, 5))]


def gaussian(p, sizes, a, dim, points):
    """Entries of (a/pi)^(D/2) P exp(-a |z|^2), the sizes from a polynomial of absolute terms in |z_i|."""
    out = []
    for z in points:
        z = [mpf(x) for x in z]
        front = (mpf(a.numerator) / a.denominator / pi) ** (mpf(dim) / 2) * exp(-mpf(a.numerator) / a.denominator * sum(x * x for x in z))
        out.append(entry(front * evaluate(p, z), front * evaluate(sizes, [abs(x) for x in z])))
    return out


def differentiated(p, a, beta):
    """D^beta of P exp(-a |z|^2), over the exponential, by the product rule."""
    for axis, n in enumerate(beta):
        for _ in range(n):
            out = times(p, {tuple(int(i == axis) for i in range(len(beta))): -2 * a})
            for alpha, c in p.items():
                if alpha[axis]:
                    key = alpha[:axis] + (alpha[axis] - 1,) + alpha[axis + 1:]
                    out[key] = out.get(key, 0) + alpha[axis] * c
            p = out
    return {alpha: c for alpha, c in p.items() if c}


def of_radial(coefficients, beta):
    """The absolute terms of D^beta g(|z|^2), g = sum_k c_k s^k exp(-s), over exp(-s), as in
    sum_(2k <= beta) prod_i beta_i!/(k_i! (beta_i - 2 k_i)!) (2 z)^(beta - 2k) g^(|beta| - |k|)(|z|^2)."""
    dim, total, sizes = len(beta), {}, {}
    for k in product(*(range(n // 2 + 1) for n in beta)):
        profile = list(coefficients)
        for _ in range(sum(beta) - sum(k)):
            profile = [(i + 1) * profile[i + 1] - profile[i] if i + 1 < len(profile) else -profile[i] for i in range(len(profile))]
        front = F(1)
        for n, j in zip(beta, k):
            front *= F(factorial(n), factorial(j) * factorial(n - 2 * j)) * 2 ** (n - 2 * j)
        monomial = {tuple(n - 2 * j for n, j in zip(beta, k)): front}
        for out, part in ((total, radial(profile, dim)), (sizes, radial([abs(c) for c in profile], dim))):
            for alpha, c in times(monomial, part).items():
                out[alpha] = out.get(alpha, 0) + c
    p = differentiated(radial(coefficients, dim), F(1), beta)
    assert p == {alpha: c for alpha, c in total.items() if c}
    return p, sizes


def exchange():
    """The exchange kernels of pse_kernels.json."""
    with open(os.path.join(HERE, "pse_kernels.json")) as file:
        table = json.load(file)["full_space"]
    for operator, kernels in table.items():
        for key, kernel in kernels.items():
            dim, order = int(key[1]), int(key[4:])
            p = {tuple(map(int, alpha.split(","))): F(c) for alpha, c in kernel["monomials"].items()}
            yield operator, dim, order, p


# Points: full mantissas, so that squares do not fit a double.

def points(dim, radii, seed):
    draw = random.Random(seed)
    out = [(0.0,) * dim]
    for radius in radii:
        direction = [draw.gauss(0.0, 1.0) for _ in range(dim)]
        length = sum(x * x for x in direction) ** 0.5
        out.append(tuple(x / length * radius for x in direction))
    return out


RADII = [2.0 ** -28, 3e-3, 0.11, 0.27, 0.4, 0.55, 0.71, 0.83, 0.97, 1.13, 1.31, 1.47, 1.73, 1.9, 2.2, 2.6, 3.1, 3.7, 4.3,
         4.95, 5.000001, 5.6, 6.3]


def main():
    lists = {f"smooth{dim}": points(dim, RADII, dim) for dim in (1, 2, 3)}
    kernels = []

    def family(kernel, dim, a, polynomials, highest, **settings):
        name = f"smooth{dim}"
        at = lambda beta, points: gaussian(*polynomials(beta), a, dim, points)
        found = {"kernel": kernel, "dim": dim, **settings, "points": name, "values": at((0,) * dim, lists[name])}
        if highest:
            every = multi_indices(dim, range(1, highest + 1))
            found["derivatives"] = {",".join(map(str, beta)): at(beta, lists[name][::2]) for beta in every}
        kernels.append(found)

    for dim in (1, 2, 3):
        one = {(0,) * dim: F(1)}
        # The monomials of the product of Hermite polynomials.
        hermite = lambda beta: differentiated(one, F(1, 2), beta)
        family("Gaussian", dim, F(1, 2), lambda beta: (hermite(beta), absolute(hermite(beta))), 4)
        family("WideGaussian", dim, F(1, 4), lambda beta: (one, one), 0)
    for operator, dim, order, p in exchange():
        if operator == "identity":
            c = [p[(2 * k,) + (0,) * (dim - 1)] for k in range(order // 2)]
            family("HighOrderGaussian", dim, F(1), lambda beta: of_radial(c, beta), 4 if dim < 3 else 3, order=order)
        # The monomials of P.
        family("Exchange", dim, F(1), lambda beta: (p, absolute(p)), 0, operator=operator, order=order)
    table = {"points": lists, "kernels": kernels}
    lines = ["{\n\"points\": {"]
    lines.append(",\n".join(f"{json.dumps(name)}: {json.dumps(points, separators=(',', ':'))}" for name, points in lists.items()))
    lines.append("},\n\"kernels\": [")
    lines.append(",\n".join(json.dumps(kernel, separators=(",", ":")) for kernel in kernels))
    lines.append("]\n}\n")
    with open(os.path.join(HERE, "kernel_values.json"), "w") as file:
        file.write("\n".join(lines))


main()
